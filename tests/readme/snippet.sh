#!/usr/bin/env bash
# usage: snippet.sh NPT SNIPPET WEIGHTS FOLDER
# Runs the README's snippet on two meshes and compares what it writes with the program's result.
set -euo pipefail
npt=$1 snippet=$2 weights=$3
rm -rf "$4"
mkdir -p "$4"
cd "$4"
cp -r "$weights/readers" .
for name in human human-pooled; do
  cp "$weights/$name.safetensors" human.safetensors
  "$npt" generate --out identity.obj --seed 3 --pose rest
  "$npt" generate --out pose.ply --seed 8 --pose random
  "$snippet"
  "$npt" transfer --weights human.safetensors --identity identity.obj --pose pose.ply --out expected.obj
  cmp posed.obj expected.obj
  rm posed.obj
done
