#!/usr/bin/env bash
# Builds npt and runs every test. The first run installs the Debian packages that are missing.
# usage: tests/run.sh [--clean] [--browser] [CMAKE ARGUMENT ...]
#   --clean     build from nothing
#   --browser   also install Chromium and node, for the tests that are skipped without them
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

clean=
browser=()
while [ $# -gt 0 ]; do
  case "$1" in
    --clean) clean=yes ;;
    --browser) browser=(--browser) ;;
    -h | --help) sed -n '2,5s/^# //p' tests/run.sh; exit 0 ;;
    *) break ;;
  esac
  shift
done

bash cmake/install-dependencies.sh --tests "${browser[@]}"
[ -z "$clean" ] || rm -rf build/release
. cmake/jobs.sh
cmake --preset release "$@"
cmake --build --preset release
ctest --preset release
