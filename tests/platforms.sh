#!/usr/bin/env bash
# Builds npt for other platforms, runs there what can run, and compares transfers with this machine's to 1e-5 of a mesh's height.
# usage: tests/platforms.sh [--have] [--program] [libcxx] [newest-xsimd] [clang19] [portable] [arm64] [windows] [mpi] [deb] [python] [blender] [wasm]
#   without names: all, one after another
#   --have      installs nothing: a platform whose tools are missing is skipped; with one name that is status 77
#   --program   also builds the program for libcxx, arm64 and windows (ten minutes each) and runs its commands there
#   --build     the build folder of this machine's program, whose results are the measure; without: build/release
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

have= program= names=() native_build=build/release
while [ "$#" -gt 0 ]; do
  argument="$1"
  shift
  case "$argument" in
    --have) have=yes ;;
    --build) native_build="$1"; shift ;;
    --program) program=yes ;;
    libcxx | newest-xsimd | clang19 | portable | arm64 | windows | mpi | deb | python | blender | wasm) names+=("$argument") ;;
    -h | --help) sed -n '2,7s/^# //p' "$0"; exit 0 ;;
    *) echo "platforms.sh: unknown argument '$argument'; --help lists what is known" >&2; exit 2 ;;
  esac
done
[ "${#names[@]}" -ne 0 ] || names=(libcxx newest-xsimd clang19 portable arm64 windows mpi deb python blender wasm)

native="$native_build/bin/npt"
[ -x "$native" ] || { echo "platforms.sh: $native is missing: cmake --preset release && cmake --build --preset release" >&2; exit 1; }
folder=build/platforms/results
mkdir -p "$folder"
weights=examples/weights/human.safetensors
launcher=$(command -v ccache || true)
warnings=(-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wdouble-promotion -Werror)
library_flags=(-O2 -Iinclude -DNPT_NO_TBB tests/platforms/transfer.cpp)

# build NAME COMPILER FLAG...: the library's umbrella, readers and one network as build/platforms/results/NAME.
build() {
  local name="$1" compiler="$2"
  shift 2
  $launcher "$compiler" -std=c++20 "${warnings[@]}" "${library_flags[@]}" "$@" -c -o "$folder/$name.o"
}

# The measure: the program's transfer by the network, and what compares with it.
prepare() {
  [ -e "$folder/native" ] && [ "$folder/native" -nt tests/platforms/transfer.cpp ] && [ "$folder/native.ply" -nt "$native" ] && return
  build native c++ -march=native
  c++ "$folder/native.o" -ltinyobjloader -pthread -o "$folder/native"
  "$native" generate --shape-seed 1 --pose-seed 1 --out "$folder/identity.ply" > /dev/null
  "$native" generate --shape-seed 2 --pose-seed 2 --out "$folder/pose.ply" > /dev/null
  "$native" transfer --method network --identity "$folder/identity.ply" --pose "$folder/pose.ply" --out "$folder/native.ply" > /dev/null
}

# compared NAME EMULATOR... PROGRAM: runs the platform's transfer, holds it against the native one.
compared() {
  local name="$1"
  shift
  "$@" "$weights" "$folder/identity.ply" "$folder/pose.ply" "$folder/$name.ply"
  "$folder/native" compare "$folder/native.ply" "$folder/$name.ply"
}

# The program's commands on a platform: program NAME EMULATOR... PROGRAM
commands() {
  local name="$1"
  shift
  local out="$folder/$name-program"
  rm -rf "$out" && mkdir -p "$out"
  local foreign=$'identit\303\244t \347\214\253 \360\237\220\216.ply'  # of two, three and four bytes in UTF-8
  "$@" generate --shape-seed 1 --pose-seed 1 --out "$out/$foreign"
  "$@" info "$out/$foreign" | head -4
  mv "$out/$foreign" "$out/identity.ply"
  "$@" generate --shape-seed 2 --pose-seed 2 --out "$out/pose.ply"
  cmp "$out/pose.ply" "$folder/pose.ply" && echo "generate: the same bytes as here"
  "$@" transfer --method network --identity "$out/identity.ply" --pose "$out/pose.ply" --out "$out/network.ply"
  "$folder/native" compare "$folder/native.ply" "$out/network.ply"
  "$native" transfer --identity "$folder/identity.ply" --pose "$folder/pose.ply" --out "$folder/native-body.ply" > /dev/null
  "$@" transfer --identity "$out/identity.ply" --pose "$out/pose.ply" --out "$out/body.ply"
  # Said, not required: the fit's decisions fall otherwise between instruction sets, also on one machine.
  echo "through bodies: $("$folder/native" compare "$folder/native-body.ply" "$out/body.ply" || true)"
  "$@" render "$out/identity.ply" "$out/pose.ply" "$out/network.ply" --out "$out/picture.png"
}

libcxx() {
  local root=build/platforms/libcxx
  local flags=(-march=native -nostdinc++ -isystem "$root/usr/lib/llvm-19/include/c++/v1")
  build libcxx clang++-19 "${flags[@]}"
  clang++-19 "$folder/libcxx.o" -nostdlib++ -L"$root/usr/lib/llvm-19/lib" -L"$root/usr/lib" -ltinyobjloader -l:libc++.a -l:libc++abi.a \
    -pthread -o "$folder/libcxx"
  compared libcxx "$folder/libcxx"
  build libcxx-23 clang++-19 "${flags[@]}" -std=c++23 -fsyntax-only
  [ -z "$program" ] || { cmake --preset libcxx > /dev/null && cmake --build --preset libcxx && commands libcxx build/libcxx/bin/npt; }
}

newest-xsimd() {
  local root=build/platforms/newest-xsimd/usr/include
  grep -hE "define XSIMD_VERSION_(MAJOR|MINOR) " "$root/xsimd/config/xsimd_config.hpp"
  for set in x86-64 x86-64-v3 native; do
    build "newest-xsimd-$set" c++ "-march=$set" -isystem "$root"
    c++ "$folder/newest-xsimd-$set.o" -ltinyobjloader -pthread -o "$folder/newest-xsimd-$set"
    compared "newest-xsimd-$set" "$folder/newest-xsimd-$set"
  done
}

clang19() {
  build clang19 clang++-19 -march=native -std=c++23
  clang++-19 "$folder/clang19.o" -ltinyobjloader -pthread -o "$folder/clang19"
  compared clang19 "$folder/clang19"
  build clang19-nortti clang++-19 -march=native -fno-rtti -fsyntax-only
  build nortti c++ -march=native -fno-rtti -fsyntax-only
  build cxx23 c++ -march=native -std=c++23 -fsyntax-only
}

portable() {
  build portable c++ -march=native -DNPT_PORTABLE_SIMD
  c++ "$folder/portable.o" -ltinyobjloader -pthread -o "$folder/portable"
  compared portable "$folder/portable"
}

# No function of the micro-kernel may store accumulators to the stack in between: `fmla` and 128-bit accesses by the stack pointer.
check_spills() {
  aarch64-linux-gnu-objdump -d --no-show-raw-insn "$1" | c++filt | awk -v least="$2" '
    /^[0-9a-f]+ <.*micro_kernel</ { name = $0; ++kernels }
    /^$/ { name = "" }
    name != "" && /(str|ldr|stp|ldp)[ \t]+q[0-9]+.*\[sp/ { print "a spilled register: " name; bad = 1; name = "" }
    END { print kernels " micro-kernels, " (bad ? "some" : "none") " of which spills"; exit bad || kernels < least }'
}

arm64() {
  local root=build/platforms/arm64
  local emulator=(env QEMU_LD_PREFIX=/usr/aarch64-linux-gnu "QEMU_SET_ENV=LD_LIBRARY_PATH=$PWD/$root/usr/lib/aarch64-linux-gnu" qemu-aarch64)
  build arm64 aarch64-linux-gnu-g++ -isystem "$root/usr/include" -Wno-psabi -Wno-error=array-bounds
  aarch64-linux-gnu-g++ "$folder/arm64.o" -L"$root/usr/lib/aarch64-linux-gnu" -ltinyobjloader -pthread -o "$folder/arm64"
  check_spills "$folder/arm64.o" 10
  build arm64-bf16 aarch64-linux-gnu-g++ -march=armv8.2-a+bf16 -isystem "$root/usr/include" -Wno-psabi -fsyntax-only
  compared arm64 "${emulator[@]}" "$folder/arm64"
  [ -z "$program" ] || { cmake --preset arm64 > /dev/null && cmake --build --preset arm64 && commands arm64 "${emulator[@]}" build/arm64/bin/npt; }
}

windows() {
  local root=build/platforms/windows
  export WINEPREFIX="$PWD/$root/wine" WINEDEBUG=-all LC_ALL=C.UTF-8
  build windows x86_64-w64-mingw32-g++-posix -mavx2 -mfma -Wa,-mbig-obj -isystem "$root/usr/include"
  x86_64-w64-mingw32-g++-posix -static "$folder/windows.o" -L"$root/usr/lib" -ltinyobjloader -o "$folder/windows.exe"
  compared windows /usr/lib/wine/wine64 "$folder/windows.exe"
  [ -z "$program" ] || { cmake --preset windows > /dev/null && cmake --build --preset windows && commands windows /usr/lib/wine/wine64 build/windows/bin/npt.exe; }
}

mpi() { bash tests/platforms/mpi.sh; }

deb() { bash tests/platforms/deb.sh "$native_build"; }

python() { bash tests/platforms/python.sh "$native_build" "$have"; }

blender() { bash tests/platforms/blender.sh "$native_build" "$have"; }

wasm() { bash tests/platforms/wasm.sh "$native_build"; }

failed=()
for name in "${names[@]}"; do
  echo "== $name"
  if [ "$name" != portable ]; then
    if [ -z "$have" ]; then
      cmake/platform-packages.sh "$name"
    elif ! cmake/platform-packages.sh "$name" --have; then
      echo "$name: skipped, its tools are not installed (tests/platforms.sh $name installs them)"
      [ "${#names[@]}" -gt 1 ] || exit 77
      continue
    fi
  fi
  set +e  # not `if (...)`: within a condition a failing command would not end the platform's run
  (
    set -e
    case "$name" in mpi | deb | python | blender | wasm) ;; *) prepare ;; esac
    "$name"
  )
  status=$?
  set -e
  case "$status" in
    0) echo "$name: passed" ;;
    77) echo "$name: skipped" ;;
    *) echo "$name: FAILED"; failed+=("$name") ;;
  esac
done
[ "${#failed[@]}" -eq 0 ] || { echo "platforms.sh: failed: ${failed[*]}" >&2; exit 1; }
