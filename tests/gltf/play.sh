#!/usr/bin/env bash
# usage: play.sh validator|three|godot|blender FOLDER SHARED NODE NODE_MODULES GODOT BLENDER
# What transfers.sh made in FOLDER, judged by Khronos' validator or played by others, or what is missing for that.
set -euo pipefail
player=$1 folder=$2 characters=$3/data/characters/humanoids node=$4 godot=$6 blender=$7
here=$(dirname "$(realpath "$0")")

if [ "$player" = godot ]; then
  [ -x "$godot" ] || { echo "SKIPPED: godot3-server is not installed (cmake/install-dependencies.sh --dev)"; exit 0; }
elif [ "$player" = blender ]; then
  [ -x "$blender" ] || { echo "SKIPPED: blender is not installed"; exit 0; }
else
  [ -x "$node" ] || { echo "SKIPPED: node is not installed"; exit 0; }
fi
cd "$folder/made"
played=()
for file in *.glb; do [ ! -e "${file%.glb}.json" ] || played+=("$PWD/$file"); done
case "$player" in
  validator)
    export NODE_PATH="$5:${NODE_PATH:-}"
    "$node" -e 'require("gltf-validator")' 2> /dev/null || {
      echo "SKIPPED: npm's gltf-validator is not there (cmake/install-dependencies.sh --browser)"
      exit 0
    }
    judged=()
    # What is in others' files stays, with the errors that it has.
    for file in *.glb; do [ -e "$characters/$file" ] && judged+=("$file=$characters/$file") || judged+=("$file"); done
    "$node" "$here/validate.js" "${judged[@]}" ;;
  three) "$node" "$here/play_three.js" "$here/../../examples/npt/view/three/three.min.js" "${played[@]}" ;;
  blender) "$blender" --background --factory-startup --python-exit-code 1 --python "$here/play_blender.py" -- "${played[@]}" | grep "off by" ;;
  godot) "$here/play_godot.sh" "$godot" "$folder/godot" "${played[@]}" ;;
esac
