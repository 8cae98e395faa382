#!/bin/sh
# The version stands in include/npt/config.hpp (cmake/version.sh). What can't read it there names the same one.
set -eu
cd "$(dirname "$0")/../.."
version=$(cmake/version.sh)
status=0
expect() {  # FILE PATTERN: it has one line of the pattern, with the version for VERSION
  found=$(grep -cE "$(echo "$2" | sed "s/VERSION/$version/")" "$1" || true)
  [ "$found" = 1 ] || { echo "$1: found $found lines '$2', expected one with $version" >&2; status=1; }
}
expect cmake/ports/vcpkg/vcpkg.json '^  "version": "VERSION",$'
expect docs/quickstart-research.md '^  version = \{VERSION\},$'
expect CHANGELOG.md '^## Version VERSION$'
# These are written when a package is made.
expect examples/blender/npt_pose_transfer/__init__.py '^    "version": \(0, 0, 0\),'
[ "$(grep -c '"version"' examples/web/package/package.json)" = 0 ] || { echo "package.json: its version is build.sh's to write" >&2; status=1; }
exit $status
