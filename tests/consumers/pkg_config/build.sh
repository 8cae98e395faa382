#!/bin/sh
# A project without CMake: the compiler and pkg-config are all it needs.
# usage: build.sh COMPILER MAIN PROGRAM
set -eu
# shellcheck disable=SC2046
"$1" -std=c++20 -O1 "$2" $(pkg-config --cflags --libs npt) -o "$3"
