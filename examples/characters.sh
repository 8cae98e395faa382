#!/usr/bin/env bash
# Five characters of different proportions, each in the natural pose of another person, and a picture: identities above, poses in the
# middle, results below. Needs the built program (cmake --build --preset release --target npt_program).
# usage: examples/characters.sh [OUT]
#   OUT   folder for the results (default build/characters)
set -euo pipefail

case "${1:-}" in
  -h | --help) sed -n '2,5s/^# //p' "$0"; exit 0 ;;
  -*) echo "characters.sh: unknown option '$1' (usage: examples/characters.sh [OUT])" >&2; exit 2 ;;
esac
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
npt=$root/build/release/bin/npt
out=${1:-$root/build/characters}
mkdir -p "$out"
cd "$out"

"$npt" generate --out identities --count 5 --format obj --proportions --shape-seed 41 --pose rest
"$npt" generate --out poses --count 5 --format obj --shape-seed 77 --pose natural --pose-seed 12
rm -f pairs.txt
identities=(identities/*.obj) poses=(poses/*.obj) results=()
for i in 0 1 2 3 4; do
  results+=("result_$i.obj")
  echo "${identities[$i]} ${poses[$i]} result_$i.obj" >> pairs.txt
done
"$npt" transfer --pairs pairs.txt
"$npt" render "${identities[@]}" "${poses[@]}" "${results[@]}" --grid 5 --row-captions "identity,pose,result" \
  --colours "blue,blue,blue,blue,blue,sand,sand,sand,sand,sand,blue,blue,blue,blue,blue" --height 220 --samples 3 \
  --background '#cbccca' --out characters.png
echo "picture $out/characters.png"
