#!/usr/bin/env bash
# Prints npt's version, such as 1.0.0, as it stands in include/npt/config.hpp.
# usage: cmake/version.sh
set -euo pipefail
header="$(dirname "${BASH_SOURCE[0]}")/../include/npt/config.hpp"
sed -nE 's/^#define NPT_VERSION_(MAJOR|MINOR|PATCH) ([0-9]+)$/\2/p' "$header" | paste -sd. | grep -xE '[0-9]+(\.[0-9]+){2}' ||
  { echo "version.sh: $header has no three lines '#define NPT_VERSION_... NUMBER'" >&2; exit 1; }
