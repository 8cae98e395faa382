#!/usr/bin/env bash
# Installs the Debian 12 packages that npt needs, only those that are missing; done at once when none is.
# usage: cmake/install-dependencies.sh [--tests] [--browser] [--docs] [--dev]
#   --tests     also what tests need that the program doesn't: numpy, for the converters; where npm is installed, two of its packages
#               into build/npm: playwright-core for pages in a browser, gltf-validator for GLB files
#   --browser   also what shows pages to the tests: Chromium, node, npm, and its two packages
#   --docs      also what makes the site (docs/site.sh) and the moving picture (docs/images/hero.sh): doxygen, markdown-it, webp
#   --dev       also the tools for work on npt itself: clang, clang-format, clang-tidy, doxygen, Google Benchmark, peers, and
#               Godot's server, in which a test plays clips
set -euo pipefail

# zlib1g-dev is libassimp-dev's need, whose targets name libz.so; it doesn't bring it.
packages=(libxtensor-dev libxsimd-dev libtbb-dev libtinyobjloader-dev doctest-dev libcli11-dev
  nlohmann-json3-dev libstb-dev libeigen3-dev liblbfgs-dev libdraco-dev libassimp-dev zlib1g-dev)
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
modules=
for argument in "$@"; do
  case "$argument" in
    --tests)
      packages+=(python3-numpy)
      modules=${modules:-wanted}
      ;;
    --browser)
      modules=needed
      command -v chromium > /dev/null || packages+=(chromium)
      command -v node > /dev/null || packages+=(nodejs)
      command -v npm > /dev/null || packages+=(npm)
      ;;
    --docs) packages+=(doxygen python3-markdown-it python3-pygments webp) ;;
    --dev) packages+=(clang clang-format clang-tidy doxygen libbenchmark-dev libdnnl-dev godot3-server) ;;
    -h | --help) sed -n '2,10s/^# //p' "$0"; exit 0 ;;
    *) echo "install-dependencies.sh: unknown argument '$argument' (--tests, --browser, --docs and --dev are known)" >&2; exit 2 ;;
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

# npm's packages, as tests/npm/package-lock.json pins them. No installation script of theirs is run.
install_modules() {
  [ -n "$modules" ] || return 0
  local folder=$root/build/npm log
  cmp -s "$root/tests/npm/package-lock.json" "$folder/package-lock.json" && [ -d "$folder/node_modules" ] && return 0
  if ! command -v npm > /dev/null || ! command -v node > /dev/null; then return 0; fi
  mkdir -p "$folder"
  cp "$root"/tests/npm/package.json "$root"/tests/npm/package-lock.json "$folder"
  echo "Installing npm's packages into $folder"
  log=$(mktemp)
  if (cd "$folder" && npm ci --ignore-scripts --no-audit --no-fund --omit=optional --fetch-retries=1 --fetch-timeout=20000) > "$log" 2>&1; then
    rm -f "$log"
    return 0
  fi
  rm -rf "$folder"
  tail -n 5 "$log" >&2
  rm -f "$log"
  echo "install-dependencies.sh: npm could not install them: tests that need them will be skipped" >&2
  [ "$modules" = wanted ]
}

if [ "${#missing[@]}" -eq 0 ]; then
  install_modules
  exit
fi

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
install_modules
