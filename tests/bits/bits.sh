#!/usr/bin/env bash
# Whether the program still gives the same bits: one line "sha256  name" for each of some 80 outputs, for this machine's instruction set.
# Every output is made with 1, 2 and 7 threads, which must give the same bits. What the program refuses has "refused" for a hash,
# whatever it says. Takes about three minutes on one core.
# usage: tests/bits/bits.sh PROGRAM [--data FOLDER] [--out TABLE] [--compare TABLE] [--only PATTERN]
#   PROGRAM           npt
#   --data FOLDER     real meshes (default ../shared/data beside the checkout; left out where it is not there)
#   --out TABLE       file for the lines (default: printed)
#   --compare TABLE   also print what differs from an earlier table; exit status 1 where anything does
#   --only PATTERN    only outputs whose name the shell pattern matches, such as 'clip*'
# Exit status 1 also where thread counts give different bits, or the program crashes or leaves no output.
set -uo pipefail
export LC_ALL=C

fail_usage() {
  echo "bits.sh: $1 (see tests/bits/bits.sh --help)" >&2
  exit 2
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
program='' data=$root/../shared/data table='' earlier='' only='*'
while [ $# -gt 0 ]; do
  case "$1" in
    -h | --help) sed -n '2,11s/^# //p' "$0"; exit 0 ;;
    --data | --out | --compare | --only)
      [ $# -ge 2 ] || fail_usage "$1 wants a value"
      case "$1" in --data) data=$2 ;; --out) table=$(realpath "$2") ;; --compare) earlier=$(realpath "$2") ;; --only) only=$2 ;; esac
      shift ;;
    -*) fail_usage "unknown option '$1'" ;;
    *) [ -z "$program" ] || fail_usage "two programs"; program=$(realpath "$1") ;;
  esac
  shift
done
[ -x "$program" ] || fail_usage "no program"
[ -z "$earlier" ] || [ -r "$earlier" ] || fail_usage "no such table: $earlier"
[ ! -d "$data" ] || data=$(cd "$data" && pwd)

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
problems=0
problem() {
  echo "bits.sh: $1" >&2
  problems=$((problems + 1))
}

# The hash of a file or of all files of a folder. Weights: of the tensors without their header, which holds the command. Scenes: without
# the program's version. No other output holds a version, a time or a path.
hash_of() {
  if [ -d "$1" ]; then
    (cd "$1" && find . -type f | sort | while read -r file; do echo "$file $(hash_of "$file")"; done | sha256sum | cut -d' ' -f1)
    return
  fi
  case "$1" in
    *.safetensors) tail -c +$((9 + $(od -An -t u8 -N 8 "$1"))) "$1" | sha256sum ;;
    *.glb) sed 's/"generator":"npt [^"]*"//' "$1" | sha256sum ;;
    *) sha256sum < "$1" ;;
  esac | cut -d' ' -f1
}

# run_once OUTPUT ARGUMENT...: runs the program; sets `hash` to that of the output, or to "refused".
run_once() {
  local output=$1 status
  shift
  rm -rf out
  mkdir out
  "$program" "$@" > out.txt 2> err.txt < /dev/null
  status=$?
  hash=refused
  if [ $status -ge 126 ]; then
    hash=crashed
  elif [ -e "$output" ]; then
    hash=$(hash_of "$output")
  elif [ $status -eq 0 ]; then
    hash=missing
  fi
}

# check NAME THREADS OUTPUT ARGUMENT...: adds a line to the table. THREADS: "each" for 1, 2 and 7; "-" where there is no such option.
check() {
  local name=$1 threads=$2 output=$3 count first=
  shift 3
  # shellcheck disable=SC2254
  case "$name" in $only) ;; *) return ;; esac
  if [ "$threads" = - ]; then
    run_once "$output" "$@"
    first=$hash
  else
    for count in 1 2 7; do
      run_once "$output" "$@" --threads $count
      if [ -z "$first" ]; then
        first=$hash
      elif [ "$hash" != "$first" ]; then
        problem "$name: $count threads give other bits than 1"
        first=differs
        break
      fi
    done
  fi
  case "$first" in
    crashed | missing) problem "$name: $first: $(head -n 2 err.txt)" ;;
  esac
  printf '%s  %s\n' "$first" "$name" >> table.txt
}

generate() { "$program" generate "$@" > out.txt || problem "generate $*"; }
# On one line, so that a table tells for which processor it was made.
processor=$(uname -m)
for flag in avx2 avx512f avx512_bf16 amx_bf16; do
  ! grep -qsw "$flag" /proc/cpuinfo || processor+=" $flag"
done
echo "# $processor" > table.txt

# What the project makes itself: meshes, a walk of 20 frames, a walker with it as a clip, a character.
mkdir people poses
generate --out rest.obj --seed 3 --pose rest
generate --out paper.ply --seed 10 --shuffle
generate --out natural.obj --seed 8 --pose natural
generate --out wide.ply --seed 9 --pose wide --shuffle
generate --out hero.obj --proportions --shape-seed 41 --pose rest
generate --out dressed.ply --clothes --seed 5 --pose natural
generate --out people --count 2 --seed 21 --pose rest --proportions
generate --out poses --count 3 --seed 22 --pose natural --same-shape
awk '$1 == "v" { printf "v %.5f %.5f %.5f\n", 172 * $2, 172 * $3 + 40, 172 * $4 - 90; next } { print }' natural.obj > hundred.obj
FRAMES=20 bash "$root/examples/animate.sh" made "$program" > out.txt || problem "animate.sh"
mv made/walk walk
pooled=$root/examples/weights/human-pooled.safetensors
made=(rest.obj paper.ply natural.obj wide.ply hero.obj dressed.ply people poses walk made/walker.glb made/character.glb made/result.glb)
for file in "${made[@]}"; do
  # shellcheck disable=SC2254
  case "made:${file##*/}" in $only) printf '%s  made:%s\n' "$(hash_of "$file")" "${file##*/}" >> table.txt ;; esac
done

transfer() {  # NAME OUTPUT ARGUMENT...
  local name=$1 output=$2
  shift 2
  check "$name" each "out/$output" transfer --out "out/$output" "$@"
}
# Pairs.
transfer pair:natural r.obj --identity rest.obj --pose natural.obj
transfer pair:wide r.ply --identity natural.obj --pose wide.ply
transfer pair:proportions r.glb --identity hero.obj --pose paper.ply
transfer pair:clothes r.ply --identity dressed.ply --pose natural.obj
transfer pair:centimetres r.obj --identity hundred.obj --pose wide.ply
transfer pair:body r.obj --method body --identity rest.obj --pose paper.ply
transfer pair:body-refined r.obj --method body --refine --identity rest.obj --pose wide.ply
transfer pair:network r.obj --method network --identity rest.obj --pose paper.ply
transfer pair:network-pairings r.obj --method network --pairings 2 --seed 4 --identity rest.obj --pose paper.ply
transfer pair:network-mirror r.obj --method network --mirror --identity rest.obj --pose paper.ply
transfer pair:network-refined r.obj --method network --refine --identity rest.obj --pose paper.ply
transfer pair:network-invariant r.obj --method network --invariant --identity rest.obj --pose paper.ply
transfer pair:network-resampled r.ply --method network --identity dressed.ply --pose paper.ply
transfer pair:pooled r.obj --method network --weights "$pooled" --identity rest.obj --pose paper.ply
transfer pair:pooled-best r.obj --method network --weights "$pooled" --mirror --refine --identity dressed.ply --pose paper.ply
transfer pair:random-weights r.obj --method network --random-weights --seed 7 --identity rest.obj --pose paper.ply

# Sequences, clips and rigs.
transfer sequence:body f --identity hero.obj --pose walk
transfer sequence:network f --method network --pairings 2 --identity rest.obj --pose walk
transfer sequence:each f --each --identity rest.obj --pose poses --format ply
transfer sequence:poses f --identity rest.obj --pose poses
transfer sequence:glb r.glb --identity hero.obj --pose walk --fps 12
transfer sequence:people f --identity people --pose walk
transfer clip:character r.glb --identity made/character.glb --pose made/walker.glb --clip walk
transfer clip:in-place r.glb --identity made/character.glb --pose made/walker.glb --clip walk --fps 15 --in-place
transfer clip:names r.glb --identity hero.obj --pose made/walker.glb --clip walk --fps 10 --names mixamo
transfer clip:frames f --identity hero.obj --pose made/walker.glb --clip walk --fps 10
transfer clip:moment r.obj --identity hero.obj --pose made/walker.glb --clip walk --time 0.3
check rig:rest each out/r.glb rig --mesh hero.obj --out out/r.glb
check rig:posed each out/r.glb rig --mesh dressed.ply --out out/r.glb --names mixamo
check rig:clip each out/r.glb rig --mesh walk/frame_00.obj --pose walk --fps 20 --out out/r.glb --names smpl

# Many pairs, with identities and poses that come again.
printf '%s\n' "rest.obj natural.obj out/1.obj" "rest.obj wide.ply out/2.obj" "natural.obj wide.ply out/3.ply" \
  "natural.obj paper.ply out/4.ply" "rest.obj none.ply out/5.obj" > list.txt
check batch:list each out transfer --pairs list.txt --keep-going
check batch:in-flight each out transfer --pairs list.txt --keep-going --in-flight 3
check batch:network each out transfer --method network --weights "$pooled" --pairs list.txt --keep-going
transfer batch:folders f --identity people --pose poses --each

# Transfer without networks.
generate --out source.obj --shape-seed 1 --pose rest
generate --out source_posed.obj --shape-seed 1 --pose wide --pose-seed 2
check deform:faces each out/r.obj deform --source source.obj --pose source_posed.obj --target rest.obj --out out/r.obj
check deform:markers each out/r.obj deform --source source.obj --pose source_posed.obj --target rest.obj --out out/r.obj --control-points 13
check skeleton each out/r.ply skeleton --identity rest.obj --pose paper.ply --out out/r.ply

# Training: samples, gradients, optimisers. The validation is a transfer on other pairs, whose error is in the header.
train() {  # NAME ARGUMENT...
  local name=$1
  shift
  check "$name" each out/w.safetensors train --out out/w.safetensors --steps 4 --validation-pairs 1 "$@"
}
train train:people --bottleneck 64 --stage 0:4x60 --natural-poses 0.3 --noise 0.01
train train:pooled --bottleneck 64 --stage 0:2xall --feature pooled --optimiser adam --edge-loss relative --yaw 30
train train:bf16 --bottleneck 64 --stage 0:4x60 --precision bf16
train train:rigs --bottleneck 64 --stage 0:4x60 --rig made/walker.glb --body mannequin --mix-bodies
train train:reader --net correspondence --stage 0:2x60 --rig made/walker.glb --body mannequin

# Pairs to evaluate on, as files.
pairs_of() {  # NAME ARGUMENT...
  local name=$1
  shift
  check "$name" - out/pairs evaluate --method network --write out/pairs --pairs 2 "$@"
}
pairs_of pairs:natural --poses natural --proportions
pairs_of pairs:clothes --poses wide --clothes --noise 0.01
pairs_of pairs:rigs --rig made/walker.glb
check render - out/r.png render rest.obj natural.obj --out out/r.png

# Real files.
if [ -d "$data" ]; then
  real() {  # NAME OUTPUT IDENTITY POSE ARGUMENT...
    local name=$1 output=$2 identity=$3 pose=$4
    shift 4
    transfer "data:$name" "$output" --identity "$data/$identity" --pose "$data/$pose" "$@"
  }
  real people:run r.ply humans/m_slim_old/table6_1.ply humans/f_heavy/natural_run01.ply
  real people:from-run r.ply humans/f_heavy/natural_run01.ply humans/m_slim_old/table6_0.ply
  real people:network r.ply humans/f_heavy/table6_0.ply humans/m_slim_old/table6_1.ply --method network --refine
  real people:sit r.ply other_topology/proxy741_m_heavy_tpose.obj humans/m_slim_old/natural_sit01.ply
  real clothed:parts r.ply clothed/parts_f_slim_tpose.ply other_topology/male1591_m_athletic_natural_run01.obj
  real clothed:surface r.ply clothed/surface_m_athletic_tpose.obj clothed/surface_m_athletic_table6_0.ply
  real topology:suit r.obj other_topology/quaternius_man_suit_tpose.obj other_topology/quaternius_man_suit_table6_0.obj
  real character:fbx r.glb characters/humanoids/rbox_male_01.fbx humans/m_slim_old/table6_0.ply
  real character:witch r.glb characters/humanoids/qwomen_witch.glb humans/m_slim_old/table6_0.ply
  real character:skeleton r.glb characters/humanoids/qskeleton2018.glb humans/m_slim_old/table6_0.ply
  real character:kaykit r.glb characters/humanoids/kk_animated_v1.fbx humans/m_slim_old/table6_0.ply --method body
  real character:sitting r.glb characters/humanoids/qmen_king.glb characters/unrigged/qposed_male_sitting.fbx
  real clip:knight r.glb characters/humanoids/rbox_female_01.fbx glb/Knight.glb --clip Walking --fps 15
  real clip:frames f humans/f_heavy/table6_0.ply glb/Knight.glb --clip Run --fps 15
  real awkward:floor r.obj awkward/person_on_floor.obj humans/m_slim_old/table6_0.ply
  real awkward:tree r.obj awkward/not_a_body_tree.obj humans/m_slim_old/table6_0.ply
  real awkward:normals r.ply awkward/normals_named_but_missing.obj humans/m_slim_old/table6_0.ply
  real animals:horse r.obj glb/Horse.glb glb/Cow.glb --weights "$root/examples/weights/quadruped.safetensors" --mirror --refine
  train data:train:animals --bottleneck 64 --stage 0:4x60 --family "$data/animals"
  pairs_of data:pairs:rigs --rig "$data/glb/Knight.glb"
fi

[ -z "$table" ] || cp table.txt "$table"
[ -n "$table$earlier" ] || cat table.txt
if [ -n "$earlier" ]; then
  # A line that only one table has differs, too; without --data those of the real files are left out, with --only all others.
  awk -v only_made="$([ -d "$data" ] || echo 1)" -v some="$([ "$only" = '*' ] || echo 1)" '
    FNR == 1 { ++file }
    /^#/ { processor[file] = $0; next }
    file == 1 { was[$2] = $1; next }
    { seen[$2]; ++compared
      if (!($2 in was)) { print "new      " $2; ++differ } else if (was[$2] != $1) { print "changed  " $2; ++differ } }
    END {
      for (name in was) if (!(name in seen) && !some && !(only_made && name ~ /^data:/)) { print "missing  " name; ++differ }
      if (processor[1] != processor[2]) print "The earlier table was made on another processor: " substr(processor[1], 3)
      printf "%d outputs compared, %d differ\n", compared, differ
      exit differ > 0
    }' "$earlier" table.txt || problems=$((problems + 1))
fi
[ $problems -eq 0 ]
