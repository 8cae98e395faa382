#!/usr/bin/env bash
# The Blender add-on in Debian's Blender: its zip is installed, its operators are run in background and held against the program;
# then its panel and cancelling in a window, where there is a virtual display (xvfb).
# usage: tests/platforms/blender.sh [BUILD FOLDER [yes | ZIP]]     without: build/release
#   yes   the C library of that build, for this machine's processor, where it is there; else one for every x86-64 processor is made
#   ZIP   this one, instead of one that is built
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

build=$(realpath "${1:-build/release}") folder=$PWD/build/platforms/blender
library=(--build "$build")
[ "${2:-}" != yes ] || [ ! -e "$build/lib/libnpt_c.so" ] || library=(--library "$build/lib/libnpt_c.so")
rm -rf "$folder" && mkdir -p "$folder/files" "$folder/user"
case "${2:-}" in
  *.zip) zip=$(realpath "$2") ;;
  *) zip=$(examples/blender/build_zip.sh "${library[@]}" "$folder") ;;
esac
export BLENDER_USER_SCRIPTS="$folder/user/scripts" BLENDER_USER_CONFIG="$folder/user/config" BLENDER_USER_DATAFILES="$folder/user/data"
mkdir -p "$BLENDER_USER_SCRIPTS/addons"
/usr/bin/blender --background --factory-startup --python-exit-code 1 --python tests/blender/test_addon.py -- "$zip" "$build/bin/npt" "$folder/files" \
  2>&1 | { grep -vE "^(Info: |Error: |Warning: |\( *0\.|Progress: |\s*(Done|Finished|Parsing|loading|building) |Import|$)|Progress: |Modules Installed|addon_utils" || true; }
if command -v xvfb-run > /dev/null; then
  LIBGL_ALWAYS_SOFTWARE=1 xvfb-run -a -s "-screen 0 800x600x24" /usr/bin/blender --factory-startup --enable-event-simulate \
    --window-geometry 0 0 800 600 --python tests/blender/window.py -- "$folder/files" 8 2>&1 | { grep -vE "Progress: |^$" || true; }
else
  echo "blender.sh: the window is left out: no xvfb-run"
fi
echo "blender.sh: $(basename "$zip"), $(du -h "$zip" | cut -f1)"
