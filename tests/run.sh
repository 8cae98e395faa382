#!/usr/bin/env bash
# Builds npt and runs every test. The first run installs the Debian packages that are missing.
# usage: tests/run.sh [--clean] [CMAKE ARGUMENT ...]
#   --clean   build from nothing
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

clean=
case "${1:-}" in
  --clean) clean=yes; shift ;;
  -h | --help) sed -n '2,4s/^# //p' tests/run.sh; exit 0 ;;
esac

bash cmake/install-dependencies.sh --tests
[ -z "$clean" ] || rm -rf build/release
cmake --preset release "$@"
cmake --build --preset release
ctest --preset release
