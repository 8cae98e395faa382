#!/usr/bin/env bash
# Makes the README's moving picture: dressed and coloured characters of different packs take over the walk of the first.
# Needs the built program, python3, and Debian's package webp (cmake/install-dependencies.sh --docs).
# usage: docs/images/hero.sh CHARACTERS [OUT] [PROGRAM]
#   CHARACTERS   folder with the files that CREDITS.md beside this names; they are no part of npt
#   OUT          picture (default docs/images/hero.webp)
#   PROGRAM      npt (default build/release/bin/npt)
# FRAMES_A_SECOND (default 20) and WIDTH of a panel in pixels (default 180) in the environment.
set -euo pipefail

case "${1:-}" in
  -h | --help) sed -n '2,8s/^# //p' "$0"; exit 0 ;;
  "" | -*) echo "hero.sh: no folder of characters (usage: docs/images/hero.sh CHARACTERS [OUT] [PROGRAM])" >&2; exit 2 ;;
esac
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
characters=$(realpath "$1")
out=$(realpath -m "${2:-$here/hero.webp}")
npt=$(realpath "${3:-$here/../../build/release/bin/npt}")
fps=${FRAMES_A_SECOND:-20}
width=${WIDTH:-180}

walker=q2019_man_longsleeve.fbx
clip='HumanArmature|Man_Walk'
taking=(qmen_king.glb kk_skeleton_rogue.glb qwomen_witch.glb qmon_yeti.glb q2019_woman_dress.fbx qskeleton2018.glb)

for name in "$walker" "${taking[@]}"; do
  [ -f "$characters/$name" ] || { echo "hero.sh: $characters has no $name; CREDITS.md says where it comes from" >&2; exit 1; }
done
for tool in cwebp img2webp python3; do
  command -v "$tool" > /dev/null || { echo "hero.sh: $tool is not installed (cmake/install-dependencies.sh --docs)" >&2; exit 1; }
done

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
folders=()
for name in "$walker" "${taking[@]}"; do
  folder=${name%.*}
  # Its own mesh as identity: the walker's frames come as those of the others do.
  "$npt" transfer --identity "$characters/$name" --pose "$characters/$walker" --clip "$clip" --fps "$fps" --out "$folder"
  python3 -B "$here/coloured.py" 1.8 "coloured/$folder" "$folder"/*.glb
  folders+=("coloured/$folder")
done

# All frames in one picture, a row for each, so that all have one scale; the last frame is the first again.
count=$(find "${folders[0]}" -name '*.obj' | wc -l)
meshes=()
for ((i = 0; i + 1 < count; ++i)); do
  for folder in "${folders[@]}"; do meshes+=("$(printf '%s/frame_%04d.obj' "$folder" "$i")"); done
done
height=$((width * 7 / 5))
"$npt" render "${meshes[@]}" --columns "${#folders[@]}" --width "$width" --height "$height" --gap 0 --background '#b9c1c9' --out all.png
frames=()
for ((i = 0; i + 1 < count; ++i)); do
  frame=$(printf 'frame_%04d.webp' "$i")
  cwebp -quiet -lossless -z 1 -crop 0 $((i * height)) $((width * ${#folders[@]})) "$height" all.png -o "$frame"
  frames+=("$frame")
done
img2webp -loop 0 -lossy -q 70 -m 6 -d $((1000 / fps)) "${frames[@]}" -o "$out" > /dev/null
echo "$out: ${#frames[@]} frames, $(stat -c %s "$out") bytes"
