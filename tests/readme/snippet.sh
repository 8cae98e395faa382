#!/usr/bin/env bash
# usage: snippet.sh NPT SNIPPET WEIGHTS FOLDER
# Runs the README's snippet on two meshes and compares the two results that it writes with the program's.
set -euo pipefail
npt=$1 snippet=$2 weights=$3
rm -rf "$4"
mkdir -p "$4"
cd "$4"
cp "$weights/human.safetensors" .
"$npt" generate --out identity.obj --seed 3 --pose rest
"$npt" generate --out pose.ply --seed 8 --pose random
"$snippet"
"$npt" transfer --weights human.safetensors --identity identity.obj --pose pose.ply --out expected.obj
cmp posed.obj expected.obj
cmp result.obj expected.obj
