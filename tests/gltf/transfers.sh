#!/usr/bin/env bash
# usage: transfers.sh PROGRAM DUMP_GLTF FOLDER [SHARED]
# Makes GLB files of every kind that `npt transfer CHARACTER CLIP` writes, and beside each, as NAME.json, where npt has the joints.
# SHARED/data/characters and SHARED/data/clips, where they are there: characters and a walk of others, too.
set -euo pipefail
npt=$1 dump=$2 shared=${4:-}

rm -rf "$3" && mkdir -p "$3" && cd "$3"
{
  "$npt" generate --count 3 --seed 5 --same-shape --pose random --out walk
  "$npt" generate --seed 5 --pose rest --out rest.ply
  "$npt" rig --mesh rest.ply --pose walk --out walker.glb
  "$npt" transfer walker.glb walker.glb --clip walk -o walk.bvh
  mkdir made
  "$npt" transfer walker.glb walk.bvh -o made/clip.glb --clip-name Stroll
  "$npt" transfer walker.glb walk.bvh -o made/applied.glb --time 0.05 --apply
  "$npt" transfer walker.glb walk.bvh -o made/baked.glb --bake
  "$npt" transfer rest.ply walk.bvh -o made/body.glb --names mixamo
  for name in ai_knight kk_skeleton_mage qmon_yeti quac_witch; do
    character=$shared/data/characters/humanoids/$name.glb
    [ ! -e "$character" ] || "$npt" transfer "$character" "$shared/data/clips/cmu_02_01.bvh" -o "made/$name.glb"
  done
} 2>&1 | { grep "error" || true; }
for file in made/*.glb; do
  [ "$file" = made/baked.glb ] || "$dump" --joints "$file" "${file%.glb}.json"
done
ls made/*.glb
