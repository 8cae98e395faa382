#!/usr/bin/env bash
# Makes the pictures gallery-*.png and people.png of docs/gallery.md. Needs the built program and python3.
# usage: docs/images/gallery.sh CHARACTERS [OUT] [PROGRAM]
#   CHARACTERS   folder with the files that are named below; CREDITS.md says whose they are; they are no part of npt
#   OUT          folder for the pictures (default: this one)
#   PROGRAM      npt (default build/release/bin/npt)
set -euo pipefail

case "${1:-}" in
  -h | --help) sed -n '2,6s/^# //p' "$0"; exit 0 ;;
  "" | -*) echo "gallery.sh: no folder of characters (usage: docs/images/gallery.sh CHARACTERS [OUT] [PROGRAM])" >&2; exit 2 ;;
esac
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
characters=$(realpath "$1")
out=$(realpath -m "${2:-$here}")
npt=$(realpath "${3:-$here/../../build/release/bin/npt}")

# Two people made with MakeHuman, running and seated: heavy-run.ply, heavy-sit.ply, slim-run.ply and slim-sit.ply, and in
# poses of Table 6: heavy-six.ply, slim-six.ply.
run=heavy-run.ply seat=slim-sit.ply
needed=("$run" heavy-sit.ply slim-run.ply "$seat" heavy-six.ply slim-six.ply rbox_male_06.fbx rbox_female_12.fbx
  qmen_king.glb qmen_swat.glb sf_base_male.glb sf_base_female.glb proxy741_m_heavy_tpose.obj parts_f_slim_tpose.ply
  qposed_male_sitting.fbx qposed_female_pickingup.fbx q2019_woman_dress.fbx
  quac_wizard.glb quac_viking_male.glb person_on_floor.obj person_on_pedestal.obj not_a_body_cube.obj
  kk_skeleton_warrior.glb qmon_yeti.glb qspace_mech_finn.glb fair_dab.bvh cmu_02_01.bvh
  male1591_m_athletic_tpose.obj kenney_char_largemale.fbx qwomen_medieval.glb)
for name in "${needed[@]}"; do
  [ -f "$characters/$name" ] || { echo "gallery.sh: $characters has no $name; CREDITS.md says whose it is" >&2; exit 1; }
done
mkdir -p "$out"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$characters"

# Behind captions, which are dark: bearable on light pages and on dark ones.
tone='#cbccca'

# The character in a pose, in the variable `made`. usage: pose NAME CHARACTER POSE [OPTION ...]
pose() {
  local name=$1 character=$2 source=$3
  shift 3
  made=$work/$name.${character##*.}
  made=${made/%.fbx/.glb}
  "$npt" transfer --identity "$character" --pose "$source" --out "$made" "$@"
}
# usage: draw PICTURE COLOURS MESH ...
draw() {
  local picture=$1 colours=$2
  shift 2
  "$npt" render "$@" --colours "$colours" --background transparent --samples 3 --width 170 --height 230 --gap 4 \
    --out "$out/gallery-$picture.png"
}
# Characters beside their results in the runner's pose. usage: beside PICTURE [--runner] CHARACTER ...
beside() {
  local picture=$1 colours= meshes=()
  shift
  if [ "$1" = --runner ]; then colours=sand meshes=("$run"); shift; fi
  for character in "$@"; do
    pose "${character%.*}" "$character" "$run"
    meshes+=("$character" "$made")
    colours+=${colours:+,}blue,blue
  done
  draw "$picture" "$colours" "${meshes[@]}"
}

beside avatars --runner rbox_male_06.fbx rbox_female_12.fbx
beside modular --runner qmen_king.glb qmen_swat.glb
beside base --runner sf_base_male.glb sf_base_female.glb
beside few --runner proxy741_m_heavy_tpose.obj parts_f_slim_tpose.ply
beside posed qposed_male_sitting.fbx qposed_female_pickingup.fbx
"$npt" generate --shape zero --pose rest --out "$work/t-pose.obj"
meshes=()
for character in "$run" "$seat" heavy-six.ply; do
  pose "t-${character%.*}" "$character" "$work/t-pose.obj"
  meshes+=("$character" "$made")
done
"$npt" render "${meshes[@]}" --colours blue,blue,blue,blue,blue,blue --view front --background transparent --samples 3 \
  --width 230 --height 260 --gap 0 --columns 6 --out "$out/gallery-tpose.png"
beside stylised kk_skeleton_warrior.glb qmon_mushroomking.glb
beside beard quac_viking_male.glb
beside wizard quac_wizard.glb
pose cube not_a_body_cube.obj "$run" --method network
pose machine qspace_mech_finn.glb "$run" --method network
draw objects blue,blue,blue,blue not_a_body_cube.obj "$work/cube.obj" qspace_mech_finn.glb "$work/machine.glb"

pose sit heavy-six.ply "$seat"
pose run slim-six.ply "$run"
"$npt" render heavy-six.ply "$seat" "$work/sit.ply" "$work/run.ply" --colour error --truth -,-,heavy-sit.ply,slim-run.ply \
  --colours blue,sand,-,- --samples 3 --width 200 --height 280 --background "$tone" --out "$out/gallery-error.png"

pose dress-run q2019_woman_dress.fbx "$run"
pose dress-sit q2019_woman_dress.fbx heavy-sit.ply
draw skirt blue,blue,blue q2019_woman_dress.fbx "$work/dress-run.glb" "$work/dress-sit.glb"
pose floor person_on_floor.obj "$run"
pose pedestal person_on_pedestal.obj "$run"
draw floor blue,blue,blue,blue person_on_floor.obj "$work/floor.obj" person_on_pedestal.obj "$work/pedestal.obj"

# Characters of four sources above their results in the runner's pose. Of the first two the file knows the ground truth:
# npt evaluate --list measures 22 mm and 29 mm.
sources=(slim-six.ply male1591_m_athletic_tpose.obj parts_f_slim_tpose.ply rbox_male_06.fbx sf_base_female.glb
  qwomen_medieval.glb qmen_swat.glb)
results=() colours=-
for character in "${sources[@]}"; do
  pose "people-${character%.*}" "$character" "$run"
  results+=("$made") colours+=,blue
done
"$npt" render - "${sources[@]}" "$run" "${results[@]}" --columns 8 --colours "$colours,sand${colours:1}" --samples 3 --width 140 \
  --height 190 --gap 0 --background "$tone" --out "$out/people.png" --column-captions \
  'pose,slim man:\n22 mm,1591 vertices:\n29 mm,clothes\nin parts,game avatar,sculpted base,low-poly\nwoman,low-poly\nsoldier'

# All rigged humanoids, in the runner's pose, with the confidence of each; what is refused stands as it is.
humanoids=(kenney_char_largemale.fbx kenney_char_small.fbx kenney_mini_female_a.glb kk_animated_v1.fbx
  kk_mannequin_medium.glb kk_skeleton_mage.glb kk_skeleton_minion.glb kk_skeleton_rogue.glb kk_skeleton_warrior.glb
  q2019_man_longsleeve.fbx q2019_woman_alternative.fbx q2019_woman_dress.fbx qfruit_banana.fbx qmen_beach.glb qmen_king.glb
  qmen_spacesuit.glb qmen_swat.glb qmon_birb.glb qmon_bunny.glb qmon_demon.glb qmon_mushroomking.glb qmon_orc.glb
  qmon_tribal.glb qmon_yeti.glb qskeleton2018.glb qspace_mech_finn.glb quac_cow.glb quac_doctor_female_young.glb
  quac_kimono_female.glb quac_knight_golden_female.glb quac_oldclassy_female.glb quac_pirate_female.glb
  quac_viking_male.glb quac_witch.glb quac_wizard.glb quac_zombie_male.glb qwomen_formal.glb qwomen_medieval.glb
  qwomen_soldier.glb qwomen_witch.glb rbox_female_01.fbx rbox_female_03.fbx rbox_female_09.fbx rbox_female_12.fbx
  rbox_male_01.fbx rbox_male_04.fbx rbox_male_06.fbx rbox_male_17.fbx sf_rpg_skeleton.glb)
panels=()
for character in "${humanoids[@]}"; do
  made=$work/all-${character%.*}.ply colour=blue
  "$npt" transfer --identity "$character" --pose "$run" --out "$made" --report "$work/report.json" || made=$character colour=grey
  caption=$(sed -n 's/.*"confidence":\(0\.[0-9]*\|1\).*/\1/p' "$work/report.json" | awk '{ printf "%.0f %%", 100 * $1 }')
  "$npt" render "$made" --colours "$colour" --samples 3 --width 96 --height 118 --background "$tone" \
    --captions "${caption:-refused}" --out "$work/panel-${character%.*}.png"
  panels+=("$work/panel-${character%.*}.png")
done
"$npt" render "${panels[@]}" --columns 10 --width 96 --height 140 --gap 2 --background "$tone" --out "$out/gallery-humanoids.png"

# Faces and UVs that stay: a wireframe, and a chessboard by UVs.
"$npt" rig --mesh kenney_char_largemale.fbx --out "$work/kenney.glb"
"$npt" rig --mesh rbox_male_06.fbx --out "$work/rbox.glb"
pose kenney-run kenney_char_largemale.fbx "$run"
python3 -B "$here/wires.py" "$work" "$work/kenney.glb" "$work/kenney-run.glb"
python3 -B "$here/wires.py" "$work" "$work/rbox.glb" "$work/people-rbox_male_06.glb"
"$npt" render "$work/kenney-wires.obj" "$work/kenney-run-wires.obj" "$work/rbox-uv.obj" \
  "$work/people-rbox_male_06-uv.obj" --background transparent --width 210 --height 280 --gap 4 --out "$out/gallery-kept.png"

# Clips without a mesh on characters' own joints: two moments of a dance, two of a walk. Each figure at its own scale.
panels=()
for moment in "fair_dab 2.0 180" "fair_dab 4.6 180" "cmu_02_01 0.6 20" "cmu_02_01 1.1 20"; do
  read -r clip time yaw <<< "$moment"
  for character in qmon_yeti.glb kk_skeleton_warrior.glb qspace_mech_finn.glb rbox_male_06.fbx q2019_woman_dress.fbx qmen_king.glb; do
    panel=$work/clips-$clip-$time-${character%.*}
    "$npt" transfer "$character" "$clip.bvh" --time "$time" --out "$panel.ply"
    "$npt" render "$panel.ply" --yaw "$yaw" --colours blue --background transparent --samples 3 --width 130 --height 170 --out "$panel.png"
    panels+=("$panel.png")
  done
done
"$npt" render "${panels[@]}" --columns 6 --background transparent --width 130 --height 170 --gap 4 --out "$out/gallery-clips.png"
