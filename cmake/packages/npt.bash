# Completion of npt's commands and options for bash: from what the program says of itself.
_npt() {
  local word="${COMP_WORDS[COMP_CWORD]}" program="${COMP_WORDS[0]}"
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    mapfile -t COMPREPLY < <(compgen -W "$("$program" --help 2> /dev/null | sed -n 's/^  \([a-z][a-z]*\) .*/\1/p')" -- "$word")
  elif [[ "$word" == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$("$program" "${COMP_WORDS[1]}" --help 2> /dev/null | grep -oE '^ +(-[a-z],)?--[a-z-]+' | grep -oE -e '--[a-z-]+')" -- "$word")
  fi
}
complete -o default -F _npt npt
