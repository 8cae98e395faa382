#!/usr/bin/env bash
# How many instructions npt takes, counted by callgrind: they hardly depend on what else the machine does, so changes of 1 % show.
# With one thread. The program is built for AVX2 without multiply-adds: valgrind knows no AVX-512, and calls a function for each lane
# of a multiply-add (a pair by body estimation was not done after four minutes, instead of 23 s). The whole takes 70 s.
#   cmake -B build/count -DCMAKE_BUILD_TYPE=Release -DNPT_BUILD_TESTS=OFF -DNPT_NATIVE=OFF -DCMAKE_CXX_FLAGS=-mavx2
#   cmake --build build/count --target npt_program
# usage: bench/instructions.sh PROGRAM [--out TABLE] [--compare TABLE]
#   PROGRAM           build/count/bin/npt
#   --out TABLE       file for the lines "name  instructions" (default: printed)
#   --compare TABLE   also print changes since an earlier table; exit status 1 where one is above 2 %
# Needs the Debian package valgrind.
#
# name            what is counted
# open            the program from start to end, with the network on 700 vertices
# forward         one more run of that network: --pairings 2 less --pairings 1
# training-step   one more step on 4 pairs of 200 vertices, bottleneck 128: three steps less two
# first-result    a pair of 6890 vertices by body estimation, with opening and files
# further-frame   a second frame of the same sequence
set -euo pipefail
export LC_ALL=C

fail_usage() {
  echo "instructions.sh: $1 (see bench/instructions.sh --help)" >&2
  exit 2
}

program='' table='' earlier=''
while [ $# -gt 0 ]; do
  case "$1" in
    -h | --help) sed -n '2,18s/^# \{0,1\}//p' "$0"; exit 0 ;;
    --out | --compare)
      [ $# -ge 2 ] || fail_usage "$1 wants a file"
      case "$1" in --out) table=$(realpath "$2") ;; --compare) earlier=$(realpath "$2") ;; esac
      shift ;;
    -*) fail_usage "unknown option '$1'" ;;
    *) [ -z "$program" ] || fail_usage "two programs"; program=$(realpath "$1") ;;
  esac
  shift
done
[ -x "$program" ] || fail_usage "no program"
[ -z "$earlier" ] || [ -r "$earlier" ] || fail_usage "no such table: $earlier"
command -v valgrind > /dev/null || fail_usage "valgrind is missing"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# Instructions of a run of the program with one thread.
count() {
  if ! valgrind --tool=callgrind --callgrind-out-file=/dev/null "$program" "$@" --threads 1 > out.txt 2> err.txt; then
    tail -n 5 err.txt >&2
    echo "instructions.sh: npt $* fails" >&2
    exit 1
  fi
  awk '/Collected :/ { print $NF }' err.txt
}
train() { count train --out "w$1.safetensors" --bottleneck 128 --stage 0:4x200 --validation-pairs 0 --steps "$1"; }

"$program" generate --out identity.obj --seed 3 --pose rest > out.txt
# Its first 700 vertices, and the faces between them: a small mesh for the network.
awk -v most=700 '$1 == "v" { if (++count <= most) print; next }
  $1 == "f" { for (i = 2; i <= NF; ++i) { split($i, corner, "/"); if (corner[1] > most) next } print }' identity.obj > part.obj
"$program" generate --out natural --count 2 --same-shape --pose natural --seed 8 --format obj > out.txt
# The second frame lies a tenth of the way to another pose, as a sequence's frames follow each other.
mkdir one frames
cp natural/body_0000.obj one/0.obj
cp natural/body_0000.obj frames/0.obj
awk '$1 == "v" { n = ++seen[FILENAME] }
  FNR == NR { if ($1 == "v") { x[n] = $2; y[n] = $3; z[n] = $4 } next }
  $1 == "v" { printf "v %.6f %.6f %.6f\n", x[n] + ($2 - x[n]) / 10, y[n] + ($3 - y[n]) / 10, z[n] + ($4 - z[n]) / 10; next }
  { print }' natural/body_0000.obj natural/body_0001.obj > frames/1.obj

network=(transfer --method network --identity part.obj --pose part.obj --out r.obj)
open=$(count "${network[@]}")
twice=$(count "${network[@]}" --pairings 2)
two_steps=$(train 2)
three_steps=$(train 3)
first=$(count transfer --identity identity.obj --pose one --out results --method body)
two_frames=$(count transfer --identity identity.obj --pose frames --out more --method body)
printf '%-14s %14d\n' open "$open" forward $((twice - open)) training-step $((three_steps - two_steps)) \
  first-result "$first" further-frame $((two_frames - first)) > table.txt
[ -z "$table" ] || cp table.txt "$table"
[ -n "$table$earlier" ] || cat table.txt
[ -z "$earlier" ] || awk 'FNR == NR { was[$1] = $2; next }
  { change = $1 in was ? 100 * ($2 / was[$1] - 1) : 0; printf "%-14s %14.0f  was %14.0f  %+.2f %%\n", $1, $2, was[$1], change
    if (change > 2) ++slower }
  END { exit slower > 0 }' "$earlier" table.txt
