#!/usr/bin/env bash
# Installs the Debian 12 packages that npt needs, only those that are missing; done at once when none is.
# usage: cmake/install-dependencies.sh [--tests] [--dev]
#   --tests   also what tests need that the program doesn't: numpy, for the converters
#   --dev     also the tools for work on npt itself: clang, clang-format, clang-tidy, doxygen, Google Benchmark, peers
set -euo pipefail

packages=(libxtensor-dev libxsimd-dev libtbb-dev libtinyobjloader-dev doctest-dev libcli11-dev
  nlohmann-json3-dev libstb-dev libeigen3-dev liblbfgs-dev libdraco-dev)
for argument in "$@"; do
  case "$argument" in
    --tests) packages+=(python3-numpy) ;;
    --dev) packages+=(clang clang-format clang-tidy doxygen libbenchmark-dev libdnnl-dev) ;;
    -h | --help) sed -n '2,5s/^# //p' "$0"; exit 0 ;;
    *) echo "install-dependencies.sh: unknown argument '$argument' (--tests and --dev are known)" >&2; exit 2 ;;
  esac
done

# The compiler, CMake and make may come from anywhere, so look for the commands and not for their packages.
command -v cmake > /dev/null || packages+=(cmake)
command -v make > /dev/null || command -v ninja > /dev/null || packages+=(make)
command -v c++ > /dev/null || command -v g++ > /dev/null || command -v clang++ > /dev/null || packages+=(g++)

command -v dpkg-query > /dev/null || {
  echo "install-dependencies.sh: this is not a Debian system. Install by hand what these Debian packages hold:" >&2
  echo "  ${packages[*]}" >&2
  exit 1
}

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2> /dev/null || true)
  [ "$status" = installed ] || missing+=("$package")
done
[ "${#missing[@]}" -eq 0 ] && exit 0

run=()
if [ "$(id -u)" -ne 0 ]; then
  if command -v sudo > /dev/null && { sudo -n true 2> /dev/null || [ -t 0 ]; }; then
    run=(sudo)
  else
    echo "install-dependencies.sh: these packages are missing and installing them needs root:" >&2
    echo "  apt-get install ${missing[*]}" >&2
    exit 1
  fi
fi

echo "Installing ${missing[*]}"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt=("${run[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0)
# The package lists of a fresh container are empty, those of an old machine name files that are gone: refresh, then
# install. A failed refresh alone is no reason to stop, the lists at hand may do.
"${apt[@]}" update > "$log" 2>&1 || true
if ! "${apt[@]}" install -y --no-install-recommends "${missing[@]}" >> "$log" 2>&1; then
  cat "$log" >&2
  echo "install-dependencies.sh: apt-get could not install: ${missing[*]}" >&2
  exit 1
fi
