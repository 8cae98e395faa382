#!/usr/bin/env bash
# usage: play_godot.sh GODOT FOLDER FILE.glb ...     with NAME.json beside each file
# A project of the files in FOLDER, which Godot 3's server imports and plays (Debian: godot3-server).
set -euo pipefail
godot=$1 folder=$2 here=$(dirname "$(realpath "$0")")
shift 2

rm -rf "$folder" && mkdir -p "$folder/home" "$folder/project"
cp "$here/play_godot.gd" "$folder/project/play.gd"
printf 'config_version=4\n' > "$folder/project/project.godot"
for file in "$@"; do
  cp "$file" "${file%.glb}.json" "$folder/project"
  # Curves sampled densely, none of their samples left out.
  printf '[remap]\nimporter="scene"\ntype="PackedScene"\n[deps]\nsource_file="res://%s"\n[params]\nmaterials/location=0\nmaterials/storage=0\nanimation/import=true\nanimation/fps=120\nanimation/optimizer/enabled=false\n' \
    "$(basename "$file")" > "$folder/project/$(basename "$file").import"
done
# What it says of a machine without a display is no part of this.
export HOME=$folder/home
"$godot" --path "$folder/project" --editor --quit > "$folder/import.txt" 2>&1
"$godot" --path "$folder/project" -s play.gd 2> "$folder/play.txt" | grep -v "^$\|^Godot Engine"
