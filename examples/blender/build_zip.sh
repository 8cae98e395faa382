#!/usr/bin/env bash
# The Blender add-on as one zip, with the Python package inside: Edit > Preferences > Add-ons > Install in Blender 3.3 or newer.
# usage: examples/blender/build_zip.sh [OPTIONS of examples/python/build_wheel.sh] [OUT]
#   OUT   folder of the zip; without: build/blender
set -euo pipefail
project=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
options=() out=build/blender
while [ "$#" -gt 0 ]; do
  case "$1" in
    --build | --library) options+=("$1" "$2"); shift 2 ;;
    -h | --help) sed -n '2,4s/^# //p' "$0"; exit 0 ;;
    -*) echo "build_zip.sh: unknown argument '$1'; --help lists what is known" >&2; exit 2 ;;
    *) out=$1; shift ;;
  esac
done
mkdir -p "$out"
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
wheel=$("$project/examples/python/build_wheel.sh" "${options[@]}" "$stage/wheel")
cp -r "$project/examples/blender/npt_pose_transfer" "$stage"
cp "$project/LICENSE" "$stage/npt_pose_transfer"
version=$("$project/cmake/version.sh")
sed -i "s/\"version\": (0, 0, 0),.*/\"version\": (${version//./, }),/" "$stage/npt_pose_transfer/__init__.py"
python3 - "$wheel" "$stage/npt_pose_transfer" "$out/npt_pose_transfer.zip.part" << 'PYTHON'
import pathlib, sys, zipfile
wheel, addon, out = map(pathlib.Path, sys.argv[1:])
with zipfile.ZipFile(wheel) as package:
    package.extractall(addon, [name for name in package.namelist() if name.startswith("npt/")])
with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
    for file in sorted(addon.rglob("*")):
        if file.is_file() and "__pycache__" not in file.parts:
            archive.write(file, file.relative_to(addon.parent))
PYTHON
mv "$out/npt_pose_transfer.zip.part" "$out/npt_pose_transfer.zip"
echo "$out/npt_pose_transfer.zip"
