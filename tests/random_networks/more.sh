#!/usr/bin/env bash
# More random networks than the suite has: compiles TYPES networks from seed FIRST on, and runs GRAPHS graphs.
# usage: tests/random_networks/more.sh [FIRST] [TYPES] [GRAPHS]
#   defaults: 1000, 24 (about 2 s of compile time each), 5000 (about 200 a second)
#   CXX, CXXFLAGS   compiler and further flags
set -euo pipefail
case "${1:-}" in
  -h | --help) sed -n '2,5s/^# //p' "${BASH_SOURCE[0]}"; exit 0 ;;
esac
first=${1:-1000} types=${2:-24} graphs=${3:-5000}
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../..
build=$(mktemp -d)
trap 'rm -rf "$build"' EXIT

includes=(-I"$root/include" -I"$here/.." -I"$here")
compile() { "${CXX:-g++}" -std=c++20 -O1 -march=native -w -DNPT_NO_TBB "${includes[@]}" ${CXXFLAGS:-} "$@"; }

compile "$here/list_seeds.cpp" -o "$build/list_seeds"
for unit in "$here"/check.cpp "$here"/test_recorded_graphs.cpp "$here"/../support/main.cpp; do
  compile -c "$unit" -o "$build/$(basename "$unit").o"
done
mapfile -t seeds < <("$build/list_seeds" "$first" "$types")
echo "types: ${seeds[*]}"
per_unit=6
for ((i = 0; i < ${#seeds[@]}; i += per_unit)); do
  list=$(IFS=,; echo "${seeds[*]:i:per_unit}")
  scalar=double
  [ $((i / per_unit % 2)) = 0 ] || scalar=float
  cat > "$build/types$i.cpp" << UNIT
#include <doctest/doctest.h>
#include "typed_network.hpp"
TEST_CASE("types $list") { random_networks::check_typed_networks<$scalar, $list>(); }
UNIT
  compile -c "$build/types$i.cpp" -o "$build/types$i.o"
done
compile "$build"/*.o -o "$build/test" -pthread
NPT_FIRST_SEED=$first NPT_SEEDS=$graphs "$build/test"
