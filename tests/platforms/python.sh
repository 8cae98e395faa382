#!/usr/bin/env bash
# The Python package: built as a wheel, installed into a fresh virtual environment beside Debian's numpy, held against the program.
# usage: tests/platforms/python.sh [BUILD FOLDER [yes]]     without: build/release
#   yes   the C library of that build, for this machine's processor, where it is there; else one for every x86-64 processor is made
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

build=$(realpath "${1:-build/release}") folder=build/platforms/python
library=(--build "$build")
if [ -n "${2:-}" ] && [ -e "$build/lib/libnpt_c.so" ]; then
  library=(--library "$build/lib/libnpt_c.so")
  export NPT_SAME_BUILD=yes  # the program's bits are expected
fi
rm -rf "$folder" && mkdir -p "$folder"
wheel=$(examples/python/build_wheel.sh "${library[@]}" "$folder")
/usr/bin/python3 -m venv --system-site-packages "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-index --no-deps "$wheel"
"$folder/venv/bin/python" -B tests/python/test_npt.py "$build/bin/npt"
"$folder/venv/bin/python" -B tests/python/test_motion.py
echo "python.sh: $(basename "$wheel"), $(du -h "$wheel" | cut -f1)"
