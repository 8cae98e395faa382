#!/usr/bin/env bash
# The Python package as a wheel, with the C library and the weights that npt ships inside. Needs Debian's python3-build,
# python3-setuptools and python3-wheel.
# usage: examples/python/build_wheel.sh [--build FOLDER] [--library FILE] [OUT]
#   OUT         folder of the wheel; without: build/python
#   --build     the build folder in which the library is made for every x86-64 instruction set; without: build/release
#   --library   this C library instead, such as build/release/lib/libnpt_c.so, which is for this machine's processor
set -euo pipefail
out=build/python build=build/release library=
project=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
while [ "$#" -gt 0 ]; do
  case "$1" in
    --build) build=$2; shift 2 ;;
    --library) library=$2; shift 2 ;;
    -h | --help) sed -n '2,7s/^# //p' "$0"; exit 0 ;;
    -*) echo "build_wheel.sh: unknown argument '$1'; --help lists what is known" >&2; exit 2 ;;
    *) out=$1; shift ;;
  esac
done

if [ -z "$library" ]; then
  [ -e "$build/CMakeCache.txt" ] || cmake -S "$project" --preset release -B "$build" > /dev/null
  . "$project/cmake/jobs.sh"
  cmake --build "$build" --target npt_c_multi_isa > /dev/null
  library=$build/lib/libnpt_c_multi_isa.so
fi
[ -e "$library" ] || { echo "build_wheel.sh: $library is missing" >&2; exit 1; }
command -v readelf > /dev/null || { echo "build_wheel.sh: readelf is missing, which reads the library's needs: apt-get install binutils" >&2; exit 1; }
# The first python3 of the path that has what builds a wheel: others may stand in front of the system's. Asked from /, for a
# folder that is called build counts as a module.
python=
for candidate in $(type -ap python3) /usr/bin/python3; do
  if (cd / && "$candidate" -c "import build, setuptools, wheel") 2> /dev/null; then python=$candidate; break; fi
done
[ -n "$python" ] || { echo "build_wheel.sh: no python3 with build, setuptools and wheel: apt-get install python3-build python3-setuptools python3-wheel" >&2; exit 1; }

mkdir -p "$out"
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
cp -r "$project/examples/python/npt" "$project/examples/python/pyproject.toml" "$project/examples/python/setup.py" "$project/LICENSE" "$stage"
rm -rf "$stage"/npt/__pycache__
mkdir -p "$stage/npt/lib" "$stage/npt/weights"
cp -L "$library" "$stage/npt/lib/libnpt_c.so"
cp "$project"/examples/weights/*.safetensors "$stage/npt/weights"
"$project/cmake/version.sh" > "$stage/version.txt"
"$project/cmake/packages/notices.sh" wheel > "$stage/npt/NOTICE.txt"
"$python" -m build --wheel --no-isolation --outdir "$stage/dist" "$stage" > "$stage/log.txt" 2>&1 || { cat "$stage/log.txt" >&2; exit 1; }
rm -f "$out"/npt-*.whl
mv "$stage"/dist/*.whl "$out"
ls "$out"/npt-*.whl
