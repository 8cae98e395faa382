#!/usr/bin/env bash
# The Python package: built as a wheel, installed into a fresh virtual environment beside Debian's numpy, held against the program.
# usage: tests/platforms/python.sh [BUILD FOLDER [yes | WHEEL]]     without: build/release
#   yes     the C library of that build, for this machine's processor, where it is there; else one for every x86-64 processor is made
#   WHEEL   this one, instead of one that is built
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

build=$(realpath "${1:-build/release}") folder=build/platforms/python
library=(--build "$build")
if [ "${2:-}" = yes ] && [ -e "$build/lib/libnpt_c.so" ]; then
  library=(--library "$build/lib/libnpt_c.so")
  export NPT_SAME_BUILD=yes  # the program's bits are expected
fi
rm -rf "$folder" && mkdir -p "$folder"
case "${2:-}" in
  *.whl) wheel=$2 ;;
  *) wheel=$(examples/python/build_wheel.sh "${library[@]}" "$folder") ;;
esac
/usr/bin/python3 -m venv --system-site-packages "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-index --no-deps "$wheel"
# The name says the newest glibc symbol that the library asks for, and the library for every processor avoids those after 2.34.
newest=$(objdump -T "$folder"/venv/lib/python3*/site-packages/npt/lib/libnpt_c.so | grep -oE 'GLIBC_[0-9.]+' | sort -uV | tail -1)
case "$wheel" in
  *-manylinux_"$(echo "${newest#GLIBC_}" | tr . _)"_x86_64.whl)
    printf '%s\n' "$newest" GLIBC_2.34 | sort -CV || { echo "python.sh: the library asks for $newest, expected 2.34 at most" >&2; exit 1; } ;;
  *-linux_*.whl) [ -n "${NPT_SAME_BUILD:-}" ] || { echo "python.sh: $wheel is for this system alone" >&2; exit 1; } ;;
  *) echo "python.sh: $wheel holds a library that asks for $newest" >&2; exit 1 ;;
esac
"$folder/venv/bin/python" -B tests/python/test_npt.py "$build/bin/npt"
"$folder/venv/bin/python" -B tests/python/test_motion.py
echo "python.sh: $(basename "$wheel"), $(du -h "$wheel" | cut -f1)"
