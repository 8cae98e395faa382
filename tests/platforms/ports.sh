#!/usr/bin/env bash
# The ports for vcpkg and Conan without either: stand-ins for what they call run the portfile and the recipe, each of which must install
# what find_package finds.
# usage: tests/platforms/ports.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

folder=build/platforms/ports
rm -rf "$folder" && mkdir -p "$folder"
version=$(cmake/version.sh)

found() {  # NAME PREFIX
  cmake -S tests/consumers/find_package -B "$folder/$1-consumer" "-Dnpt_DIR=$2/share/cmake/npt" > "$folder/$1-consumer.txt"
  grep -q "npt_DIR:[A-Z]*=$2/" "$folder/$1-consumer/CMakeCache.txt"
  echo "ports.sh: $1: find_package finds what it installs"
}

cmake -DOUT="$PWD/$folder/vcpkg" -DVERSION="$version" -P tests/platforms/vcpkg.cmake
found vcpkg "$PWD/$folder/vcpkg/packages"
python3 tests/platforms/conan.py "$PWD/$folder/conan" "$version"
found conan "$PWD/$folder/conan/package"
