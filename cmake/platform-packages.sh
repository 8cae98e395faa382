#!/usr/bin/env bash
# Installs the Debian 12 tools that building for a platform needs, only those that are missing, and puts the platform's libraries
# into build/platforms/NAME, where the toolchain files and presets look for them. Done at once when all is there.
# usage: cmake/platform-packages.sh arm64|windows|libcxx|clang19|newest-xsimd|mpi|deb|python|blender|wasm|site|chroot [--have]
#   --have   installs nothing; status 1 where something is missing
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

name="${1:-}" have="${2:-}"
headers=(libxtensor-dev xtl-dev libxsimd-dev doctest-dev libcli11-dev nlohmann-json3-dev libstb-dev libeigen3-dev libtinyobjloader-dev
  liblbfgs-dev)
architecture=$(dpkg --print-architecture) suite=bookworm tools=() libraries=()
case "$name" in
  arm64)
    architecture=arm64 tools=(g++-aarch64-linux-gnu qemu-user)
    libraries=("${headers[@]}" libtbb-dev libtbb12 libtbbbind-2-5 libtbbmalloc2 liblbfgs0 libtinyobjloader2rc10) ;;
  windows) tools=(g++-mingw-w64-x86-64-posix wine64) libraries=("${headers[@]}") ;;
  libcxx)
    tools=(clang-19)
    libraries=(libtinyobjloader-dev libc++-19-dev libc++abi-19-dev libc++1-19 libc++abi1-19 libunwind-19 libunwind-19-dev) ;;
  clang19) tools=(clang-19) ;;
  newest-xsimd) suite=sid libraries=(libxsimd-dev) ;;
  mpi) tools=(libopenmpi-dev openmpi-bin) ;;
  deb) tools=(lintian) ;;
  python) tools=(python3-numpy python3-venv python3-build python3-setuptools python3-wheel) ;;
  blender) tools=(blender xvfb xauth python3-numpy python3-build python3-setuptools python3-wheel) ;;
  wasm) tools=(emscripten nodejs libeigen3-dev libtinyobjloader-dev) ;;
  site) tools=(doxygen python3-markdown-it python3-pygments) ;;
  chroot) tools=(debootstrap) ;;
  *) sed -n '2,5s/^# //p' "$0" >&2; exit 2 ;;
esac
root="build/platforms/$name"

missing=()
for package in "${tools[@]}"; do
  status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2> /dev/null || true)
  [ "$status" = installed ] || missing+=("$package")
done
if [ -n "$have" ]; then
  [ "${#missing[@]}" -eq 0 ] && { [ "${#libraries[@]}" -eq 0 ] || [ -e "$root/complete" ]; }
  exit
fi
if [ "${#missing[@]}" -ne 0 ]; then
  echo "Installing ${missing[*]}"
  apt-get -qq update || true
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" > /dev/null
fi
[ "${#libraries[@]}" -eq 0 ] || [ -e "$root/complete" ] && exit 0

# The platform's libraries are unpacked, not installed: this system keeps its own. From the mirror that it uses.
echo "Fetching ${libraries[*]} for $name"
mkdir -p "$root/packages"
state=$(mktemp -d)
trap 'rm -rf "$state"' EXIT
mkdir -p "$state/lists/partial" "$state/cache/archives/partial"
touch "$state/status"
mirror=$(apt-get indextargets --format '$(SITE) $(RELEASE)' 'Created-By: Packages' | awk '$2 == "bookworm" { print $1; exit }')
[ -n "$mirror" ] || { echo "platform-packages.sh: no Debian 12 mirror among this system's package sources" >&2; exit 1; }
signed="[signed-by=/usr/share/keyrings/debian-archive-keyring.gpg]"
printf '%s\n' "deb $signed $mirror $suite main" "deb-src $signed $mirror $suite main" > "$state/sources.list"
apt=(apt-get -qq -o "Dir::Etc::sourcelist=$state/sources.list" -o Dir::Etc::sourceparts=- -o "Dir::State=$state"
  -o "Dir::State::lists=$state/lists" -o "Dir::State::status=$state/status" -o "Dir::Cache=$state/cache"
  -o "APT::Architecture=$architecture" -o "APT::Architectures::=$architecture" -o APT::Sandbox::User=root)
"${apt[@]}" update
[ "$name" != newest-xsimd ] || architecture=any
(cd "$root/packages" && "${apt[@]}" download "${libraries[@]}" > /dev/null)
for package in "$root"/packages/*.deb; do dpkg -x "$package" "$root"; done
rm -r "$root/packages"
# Some packages' CMake files name /usr, whose headers are this system's; libc++'s packages have none.
{ grep -rl --include='*.cmake' 'set(_IMPORT_PREFIX "/usr")' "$root/usr" || true; } | xargs -r sed -i "s|set(_IMPORT_PREFIX \"/usr\")|set(_IMPORT_PREFIX \"$PWD/$root/usr\")|"

# A static library of tinyobjloader, whose header is all of it, for a compiler of another standard library.
build_tinyobjloader() {
  local unit="$root/tinyobjloader.cpp" config="$root/usr/share/cmake/tinyobjloader"
  printf '#define TINYOBJLOADER_IMPLEMENTATION\n#include <tiny_obj_loader.h>\n' > "$unit"
  "$@" -O2 -std=c++17 -I"$root/usr/include" -c "$unit" -o "$root/tinyobjloader.o"
  mkdir -p "$root/usr/lib" "$config"
  rm -rf "$root"/usr/lib/*/cmake/tinyobjloader "$root"/usr/lib/*/libtinyobjloader*
  ar rcs "$root/usr/lib/libtinyobjloader.a" "$root/tinyobjloader.o"
  cat > "$config/tinyobjloaderConfig.cmake" << 'END'
add_library(tinyobjloader::tinyobjloader STATIC IMPORTED)
set_target_properties(tinyobjloader::tinyobjloader PROPERTIES
  IMPORTED_LOCATION "${CMAKE_CURRENT_LIST_DIR}/../../../lib/libtinyobjloader.a"
  INTERFACE_INCLUDE_DIRECTORIES "${CMAKE_CURRENT_LIST_DIR}/../../../include")
END
}
case "$name" in
  windows)
    build_tinyobjloader x86_64-w64-mingw32-g++-posix
    # liblbfgs is one C file; its sources come from Debian, too.
    (cd "$state" && "${apt[@]}" source --download-only --tar-only liblbfgs > /dev/null 2>&1 && tar xf liblbfgs_*.orig.tar.*)
    rm -f "$root"/usr/lib/*/liblbfgs*
    x86_64-w64-mingw32-gcc-posix -O2 -Dinline=__inline__ -I"$root/usr/include" -c "$state"/liblbfgs-*/lib/lbfgs.c -o "$root/lbfgs.o"
    ar rcs "$root/usr/lib/liblbfgs.a" "$root/lbfgs.o" ;;
  libcxx) build_tinyobjloader clang++-19 -nostdinc++ -isystem "$root/usr/lib/llvm-19/include/c++/v1" -fPIC ;;
esac
touch "$root/complete"
