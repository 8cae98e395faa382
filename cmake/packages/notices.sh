#!/usr/bin/env bash
# Prints what of others is in a package, with the texts of their licences, from parts.tsv and Debian's copyright files.
# usage: cmake/packages/notices.sh deb|windows|wheel|blender|npm|site
set -euo pipefail
project=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
package="${1:-}"
case "$package" in
  deb | windows | wheel | blender | npm | site) ;;
  -h | --help) sed -n '2,3s/^# //p' "$0"; exit 0 ;;
  *) echo "notices.sh: found '$package', expected one of deb windows wheel blender npm site" >&2; exit 2 ;;
esac
echo "npt itself: MIT, see LICENSE. This package also holds what follows, each under its own licence."
while IFS=$'\t' read -r name licence from how packages address; do
  case "$name" in "#"*) continue ;; esac
  [ "$how" != depends ] && [[ " $packages " == *" $package "* ]] || continue
  case "$from" in
    debian:*) text="/usr/share/doc/${from#debian:}/copyright" ;;
    *) text="$project/${from#*:}" ;;
  esac
  printf '\n==== %s (%s) %s\n\n' "$name" "$licence" "$address"
  case "$text" in
    *.sh) echo "MIT. It was copied from npm's package ${name}, whose authors its file names." ;;
    *) cat "$text" 2> /dev/null || echo "(The licence's text was not on the system that made this package.)" ;;
  esac
done < "$project/cmake/packages/parts.tsv"
