#!/usr/bin/env bash
# From nothing to a posed mesh and a picture of it: installs the Debian packages that are missing, builds npt-lite (npt without
# training and measuring), makes an identity and a pose mesh from the built-in mannequin, transfers the pose, renders all three.
# usage: examples/demo.sh [OUT]
#   OUT   folder for the results (default build/demo)
set -euo pipefail

case "${1:-}" in
  -h | --help) sed -n '2,5s/^# //p' "$0"; exit 0 ;;
  -*) echo "demo.sh: unknown option '$1' (usage: examples/demo.sh [OUT])" >&2; exit 2 ;;
esac
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=${1:-$root/build/demo}
mkdir -p "$out"
out=$(cd "$out" && pwd)
cd "$root"

bash cmake/install-dependencies.sh
echo "Building (the first time takes some minutes)"
. cmake/jobs.sh
log="$out/build.log"
if ! { cmake --preset release && cmake --build --preset release --target npt_lite; } > "$log" 2>&1; then
  tail -n 40 "$log" >&2
  echo "demo.sh: the build failed, all of its output is in $log" >&2
  exit 1
fi

npt=build/release/bin/npt-lite  # what poses and shows meshes: built in half the time
"$npt" generate --out "$out/identity.obj" --seed 3 --pose rest
"$npt" generate --out "$out/pose.obj" --seed 8 --pose natural

begin=$(date +%s.%N)
"$npt" transfer --identity "$out/identity.obj" --pose "$out/pose.obj" --out "$out/result.obj"
end=$(date +%s.%N)

"$npt" render "$out/identity.obj" "$out/pose.obj" "$out/result.obj" --captions "identity,pose,result" \
  --out "$out/demo.png"

echo
echo "identity  $out/identity.obj"
echo "pose      $out/pose.obj"
echo "result    $out/result.obj"
echo "picture   $out/demo.png"
awk -v b="$begin" -v e="$end" 'BEGIN { printf "The transfer took %.2f s, files and start-up included.\n", e - b }'
