#!/usr/bin/env bash
# From a GLB character and a GLB clip to an animated GLB and a page to look at it. Both are made here from the built-in mannequin: a
# walker with a skeleton and a clip, and a dressed character of other proportions; the last command is the one to copy. Needs the built
# program (cmake --build --preset release --target npt_program).
# usage: examples/animate.sh [OUT] [PROGRAM]
#   OUT       folder for the results (default build/animate)
#   PROGRAM   npt (default build/release/bin/npt)
# FRAMES in the environment: of the walk (default 24).
set -euo pipefail

case "${1:-}" in
  -h | --help) sed -n '2,8s/^# //p' "$0"; exit 0 ;;
  -*) echo "animate.sh: unknown option '$1' (usage: examples/animate.sh [OUT] [PROGRAM])" >&2; exit 2 ;;
esac
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
npt=$(realpath "${2:-$root/build/release/bin/npt}")
out=${1:-$root/build/animate}
frames=${FRAMES:-24}
mkdir -p "$out"
cd "$out"
rm -rf walk
mkdir walk

# A walk of one second, from sines: for each joint the axis angle that npt generate reads. Legs swing about x, knees and ankles follow,
# arms hang down and swing the other way; the body goes 1.3 m forward and nods twice.
for ((i = 0; i < frames; ++i)); do
  awk -v t="$i" -v n="$frames" 'BEGIN {
    turn = 8 * atan2(1, 1) * t / n
    s = sin(turn); c = cos(turn)
    for (j = 0; j < 24; ++j) x[j] = y[j] = z[j] = 0
    x[1] = -0.45 * s; x[2] = 0.45 * s                            # hips
    x[4] = 0.35 + 0.45 * (c > 0 ? c : 0); x[5] = 0.35 - 0.45 * (c < 0 ? c : 0)   # knees bend while their leg comes forward
    x[1] -= 0.15; x[2] -= 0.15
    x[7] = x[8] = -0.1
    y[0] = 0.08 * s; y[3] = y[6] = -0.07 * s                     # the hips turn, the chest turns back
    x[12] = 0.1
    hang(16, -1.25, 0.45 * s); hang(17, 1.25, -0.45 * s)
    y[18] = -0.45; y[19] = 0.45                                  # elbows
    for (j = 0; j < 24; ++j) printf "%.6f %.6f %.6f\n", x[j], y[j], z[j]
  }
  # An arm down about z, then swung about x: one axis angle.
  function hang(j, down, swing,    w, a, b, d, angle, sine) {
    w = cos(swing / 2) * cos(down / 2); a = sin(swing / 2) * cos(down / 2)
    b = -sin(swing / 2) * sin(down / 2); d = cos(swing / 2) * sin(down / 2)
    sine = sqrt(a * a + b * b + d * d); angle = 2 * atan2(sine, w)
    x[j] = a * angle / sine; y[j] = b * angle / sine; z[j] = d * angle / sine
  }' > pose.txt
  frame=$(printf 'walk/frame_%02d.obj' "$i")
  "$npt" generate --out "$frame" --shape-seed 2 --pose pose.txt > /dev/null
  awk -v t="$i" -v n="$frames" '$1 == "v" { up = 0.015 * cos(4 * 8 * atan2(1, 1) / 2 * t / n)
    printf "v %s %.6f %.6f\n", $2, $3 + up, $4 + 1.3 * t / n; next } { print }' "$frame" > moved.obj
  mv moved.obj "$frame"
done
"$npt" generate --out walker.obj --shape-seed 2 --pose rest > /dev/null
"$npt" rig --mesh walker.obj --pose walk --fps "$frames" --out walker.glb

# A character of its own proportions, with colours at its vertices: shoes, trousers, a shirt, skin, hair.
"$npt" generate --out body.obj --proportions --shape-seed "${SHAPE:-41}" --pose rest > /dev/null
awk '
  NR == FNR { if ($1 == "v") { if (low == "" || $3 < low) low = $3; if (top == "" || $3 > top) top = $3 } next }
  $1 == "v" {
    h = ($3 - low) / (top - low); side = $2 < 0 ? -$2 : $2; side /= top - low
    colour = "0.80 0.58 0.46"
    if (h < 0.035) colour = "0.16 0.13 0.12"
    else if (h < 0.54) colour = "0.13 0.19 0.33"
    else if (h < 0.78 && side < 0.22) colour = "0.72 0.27 0.20"
    else if (h > 0.93) colour = "0.17 0.11 0.08"
    print $0, colour; next
  } { print }' body.obj body.obj > character.obj
"$npt" rig --mesh character.obj --out character.glb

"$npt" transfer --identity character.glb --pose walker.glb --clip walk --fps "$frames" --out result.glb --view result.html
rm -f pose.txt body.obj character.obj walker.obj
echo "page $out/result.html"
