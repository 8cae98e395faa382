#!/usr/bin/env bash
# Builds npt for other platforms, runs there what can run, and compares transfers with this machine's to 1e-5 of a mesh's height.
# usage: tests/platforms.sh [--have] [--quick] [--build FOLDER] [libcxx] [newest-xsimd] [clang19] [portable] [arm64] [windows] [multi-isa] [mpi] [deb] [python] [blender] [wasm]
#   without names: all, one after another
#   --have      installs nothing: a platform whose tools are missing is skipped; with one name that is status 77
#   --quick     only the library in one unit and a transfer; without: also the program, the suite and packages (ten minutes and more each)
#   --build     the build folder of this machine's program, whose results are the measure; without: build/release
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

have= quick= names=() native_build=build/release
while [ "$#" -gt 0 ]; do
  argument="$1"
  shift
  case "$argument" in
    --have) have=yes ;;
    --build) native_build="$1"; shift ;;
    --quick) quick=yes ;;
    libcxx | newest-xsimd | clang19 | portable | arm64 | windows | multi-isa | mpi | deb | python | blender | wasm) names+=("$argument") ;;
    -h | --help) sed -n '2,7s/^# //p' "$0"; exit 0 ;;
    *) echo "platforms.sh: unknown argument '$argument'; --help lists what is known" >&2; exit 2 ;;
  esac
done
[ "${#names[@]}" -ne 0 ] || names=(libcxx newest-xsimd clang19 portable arm64 windows multi-isa mpi deb python blender wasm)

. cmake/jobs.sh
native="$native_build/bin/npt"
[ -x "$native" ] || { echo "platforms.sh: $native is missing: cmake --preset release && cmake --build --preset release" >&2; exit 1; }
folder=build/platforms/results
mkdir -p "$folder"
weights=examples/weights/human.safetensors
launcher=$(command -v ccache || true)
warnings=(-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wdouble-promotion -Werror)
native_clang19=(-march=native -Wno-invalid-feature-combination)  # it warns of its own flags for a processor with AVX10.1
library_flags=(-O2 -Iinclude -DNPT_NO_TBB tests/platforms/transfer.cpp)

# build NAME COMPILER FLAG...: the library's umbrella, readers and one network as build/platforms/results/NAME.
build() {
  local name="$1" compiler="$2"
  shift 2
  $launcher "$compiler" -std=c++20 "${warnings[@]}" "${library_flags[@]}" "$@" -c -o "$folder/$name.o"
}

# The measure: the program's transfer by the network, and what compares with it.
prepare() {
  [ -e "$folder/compare" ] && [ "$folder/compare" -nt tests/platforms/compare.cpp ] && [ "$folder/native.ply" -nt "$native" ] && return
  $launcher c++ -std=c++20 "${warnings[@]}" -O1 -Iinclude -c tests/platforms/compare.cpp -o "$folder/compare.o"
  c++ "$folder/compare.o" -ltinyobjloader -o "$folder/compare"
  "$native" generate --shape-seed 1 --pose-seed 1 --out "$folder/identity.ply" > /dev/null
  "$native" generate --shape-seed 2 --pose-seed 2 --out "$folder/pose.ply" > /dev/null
  "$native" transfer --method network --identity "$folder/identity.ply" --pose "$folder/pose.ply" --out "$folder/native.ply" > /dev/null
}

# compared NAME EMULATOR... PROGRAM: runs the platform's transfer, holds it against the native one.
compared() {
  local name="$1"
  shift
  "$@" "$weights" "$folder/identity.ply" "$folder/pose.ply" "$folder/$name.ply"
  "$folder/compare" "$folder/native.ply" "$folder/$name.ply"
}

# suite PRESET TARGETS REASON MODULE...: builds the targets, a text, and runs the tests of modules but these, which are left out for the reason.
suite() {
  local preset="$1" targets="$2" reason="$3" without
  shift 3
  without=$(printf '|%s' structure "$@")
  cmake --preset "$preset" > "$folder/$preset.txt"
  # shellcheck disable=SC2086
  cmake --build --preset "$preset" --target $targets >> "$folder/$preset.txt" 2>&1 || { tail -40 "$folder/$preset.txt" >&2; return 1; }
  # libstdc++ 12's stable_sort calls what libstdc++ 12 deprecates; clang 19 says so of two lines that sort.
  ! grep "warning: " "$folder/$preset.txt" | grep -v "get_temporary_buffer<" >&2 || return 1
  echo "not run: structure, compile_fail, consumers, convert, examples, readme (about the sources, or for this machine's compiler)"
  [ "$#" -eq 0 ] || echo "not run: $* ($reason)"
  ctest --test-dir "build/$preset" --timeout 900 -L '^module$' -E "^(${without#|})(\\.needs)?\$" --output-on-failure > "$folder/$preset-suite.txt" 2>&1 ||
    { cat "$folder/$preset-suite.txt" >&2; return 1; }
  grep -E "tests passed|Total Test time" "$folder/$preset-suite.txt"
  sed -nE 's/^[0-9]+ - ([a-z_.]+) \(Skipped\)/\1/p; s/^\t *[0-9]+ - ([a-z_.]+) \(Skipped\)/\1/p' "$folder/$preset-suite.txt" | paste -sd' ' | sed 's/^/skipped for want of what they need: /'
}
# All of it; and most modules, two programs that the build has by itself, with the part of the program that poses and shows meshes.
suite_all="npt_program npt_module_tests"
suite_most="npt_lite test_of_library test_of_networks"
beside_most=(baseline estimate formats host nn.train processor random_networks render reproduce sculpt skin threads training view)

# areas PROGRAM AREA...: the tests of the program as its users meet it.
areas() {
  local program="$1" area
  shift
  for area in "$@"; do
    bash tests/program/test_program.sh "$area" "$program" > "$folder/area.txt" 2>&1 || { cat "$folder/area.txt" >&2; return 1; }
    tail -1 "$folder/area.txt"
  done
}

# The program's commands on a platform: program NAME PROGRAM
commands() {
  local name="$1" npt="$2"
  local out="$folder/$name-program"
  rm -rf "$out" && mkdir -p "$out"
  local foreign=$'identit\303\244t \347\214\253 \360\237\220\216.ply'  # of two, three and four bytes in UTF-8
  "$npt" generate --shape-seed 1 --pose-seed 1 --out "$out/$foreign"
  "$npt" generate --shape-seed 1 --pose-seed 1 --out "$out/$foreign"  # in the place of the first
  "$npt" info "$out/$foreign" | head -4
  mv "$out/$foreign" "$out/identity.ply"
  "$npt" generate --shape-seed 2 --pose-seed 2 --out "$out/pose.ply"
  cmp "$out/pose.ply" "$folder/pose.ply" && echo "generate: the same bytes as here"
  "$npt" transfer --method network --identity "$out/identity.ply" --pose "$out/pose.ply" --out "$out/network.ply"
  "$folder/compare" "$folder/native.ply" "$out/network.ply"
  "$native" transfer --identity "$folder/identity.ply" --pose "$folder/pose.ply" --out "$folder/native-body.ply" > /dev/null
  "$npt" transfer --identity "$out/identity.ply" --pose "$out/pose.ply" --out "$out/body.ply"
  echo "by body estimation:"
  "$folder/compare" "$folder/native-body.ply" "$out/body.ply"
  "$npt" render "$out/identity.ply" "$out/pose.ply" "$out/network.ply" --out "$out/picture.png"
  head -c 5000 "$out/pose.ply" > "$out/broken.ply"
  ! "$npt" transfer --identity "$out/broken.ply" --pose "$out/pose.ply" --out "$out/none.ply" 2> "$out/error.txt" ||
    { echo "platforms.sh: a broken file was taken" >&2; return 1; }
  grep "npt: error: .*broken.ply" "$out/error.txt"
  [ ! -e "$out/none.ply" ]
}

# wrapped NAME COMMAND...: a program of this name that runs the command with its own arguments.
wrapped() {
  local name="$1"
  shift
  { printf '#!/usr/bin/env bash\nexec'; printf ' %q' "$@"; printf ' "$@"\n'; } > "$folder/$name"
  chmod +x "$folder/$name"
}

libcxx() {
  local root=build/platforms/libcxx
  local flags=("${native_clang19[@]}" -nostdinc++ -isystem "$root/usr/lib/llvm-19/include/c++/v1")
  build libcxx clang++-19 "${flags[@]}"
  clang++-19 "$folder/libcxx.o" -nostdlib++ -L"$root/usr/lib/llvm-19/lib" -L"$root/usr/lib" -ltinyobjloader -l:libc++.a -l:libc++abi.a \
    -pthread -o "$folder/libcxx"
  compared libcxx "$folder/libcxx"
  [ -z "$quick" ] || return 0
  build libcxx-23 clang++-19 "${flags[@]}" -std=c++23 -fsyntax-only
  suite libcxx "$suite_most" "a quarter of an hour to build" "${beside_most[@]}"
  commands libcxx build/libcxx/bin/npt-lite
  areas build/libcxx/bin/npt-lite info generate transfer batch
}

newest-xsimd() {
  local root=build/platforms/newest-xsimd/usr/include
  grep -hE "define XSIMD_VERSION_(MAJOR|MINOR) " "$root/xsimd/config/xsimd_config.hpp"
  local sets=(native)
  [ -n "$quick" ] || sets=(x86-64 x86-64-v3 native)
  for set in "${sets[@]}"; do
    build "newest-xsimd-$set" c++ "-march=$set" -isystem "$root"
    c++ "$folder/newest-xsimd-$set.o" -ltinyobjloader -pthread -o "$folder/newest-xsimd-$set"
    compared "newest-xsimd-$set" "$folder/newest-xsimd-$set"
  done
  [ -z "$quick" ] || return 0
  suite newest-xsimd "$suite_most" "what depends on xsimd is in the others" "${beside_most[@]}"
  commands newest-xsimd build/newest-xsimd/bin/npt-lite
}

clang19() {
  build clang19 clang++-19 "${native_clang19[@]}" -std=c++23
  clang++-19 "$folder/clang19.o" -ltinyobjloader -pthread -o "$folder/clang19"
  compared clang19 "$folder/clang19"
  [ -z "$quick" ] || return 0
  build clang19-nortti clang++-19 "${native_clang19[@]}" -fno-rtti -fsyntax-only
  build nortti c++ -march=native -fno-rtti -fsyntax-only
  build cxx23 c++ -march=native -std=c++23 -fsyntax-only
  suite clang19 "$suite_most" "a quarter of an hour to build" "${beside_most[@]}"
  commands clang19 build/clang19/bin/npt-lite
}

portable() {
  build portable c++ -O1 -march=native -DNPT_PORTABLE_SIMD  # two thirds of -O2's time
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
  build arm64 aarch64-linux-gnu-g++ -isystem "$root/usr/include" -Wno-psabi
  aarch64-linux-gnu-g++ "$folder/arm64.o" -L"$root/usr/lib/aarch64-linux-gnu" -ltinyobjloader -pthread -o "$folder/arm64"
  check_spills "$folder/arm64.o" 10
  compared arm64 "${emulator[@]}" "$folder/arm64"
  # bfloat16: the micro-kernel's squares against plain sums, a network's error, and no spills.
  aarch64-linux-gnu-g++ -std=c++20 -O2 -march=armv8.2-a+bf16 -Wno-psabi -Iinclude -Itests -isystem "$root/usr/include" -DNPT_NO_TBB -DNPT_DEFAULT_THREADS \
    tests/support/main.cpp tests/nn/kernel/test_micro_kernel.cpp tests/nn/engine/test_forward.cpp -pthread -o "$folder/arm64-bf16"
  check_spills "$folder/arm64-bf16" 30
  echo "bfmmla: $(aarch64-linux-gnu-objdump -d "$folder/arm64-bf16" | grep -c bfmmla) instructions"
  "${emulator[@]}" -cpu max "$folder/arm64-bf16" -tc="*bfloat16*,*bf16*"
  [ -z "$quick" ] || return 0
  suite arm64 "npt_program test_of_library test_of_networks $(printf ' test_%s' formats host processor render reproduce sculpt threads training view)" \
    "half a minute natively, most of an hour under qemu; nn.engine and host: below" baseline estimate skin random_networks render nn.train \
    nn.engine host
  # Beside these tests of nn.engine, the same reason; and one of host: programs can't be started from within qemu-user.
  local long="*6890*,bottleneck *,without a precision an engine*" children="a program that is run gives its output*"
  echo "not run: $long, $children"
  "${emulator[@]}" build/arm64/bin/test_of_networks "-sf=*/tests/nn/engine/*" "-tce=$long"
  "${emulator[@]}" build/arm64/bin/test_host "-tce=$children"
  wrapped npt-arm64 "${emulator[@]}" "$PWD/build/arm64/bin/npt"
  commands arm64 "$folder/npt-arm64"
  areas "$folder/npt-arm64" arguments info generate
}

windows() {
  local root=build/platforms/windows
  export WINEPREFIX="$PWD/$root/wine" WINEDEBUG=-all LC_ALL=C.UTF-8
  build windows x86_64-w64-mingw32-g++-posix -mavx2 -mfma -Wa,-mbig-obj -isystem "$root/usr/include"
  x86_64-w64-mingw32-g++-posix -static "$folder/windows.o" -L"$root/usr/lib" -ltinyobjloader -o "$folder/windows.exe"
  compared windows /usr/lib/wine/wine64 "$folder/windows.exe"
  [ -z "$quick" ] || return 0
  suite windows "$suite_all" ""
  wrapped npt-windows /usr/lib/wine/wine64 "$PWD/build/windows/bin/npt.exe"
  commands windows "$folder/npt-windows"
  # The other areas expect names with "/" in what is printed, and this machine's words for the system's errors.
  areas "$folder/npt-windows" info generate render explain doctor
  # Ctrl-C needs a console, which wine makes of a terminal.
  script -qec "/usr/lib/wine/wine64 build/windows/bin/test_host.exe -ts=needs" /dev/null < /dev/null > "$folder/windows-console.txt"
  echo "Ctrl-C: as expected"
  # The C library, called from a program in C.
  cmake --build --preset windows --target npt_c test_c_api test_c_api_same > /dev/null
  ctest --test-dir build/windows -R '^c_api[.]' --output-on-failure | grep -E "c_api|tests passed"
  # The archive: its program finds the weights that came with it.
  rm -rf "$folder/windows-archive" && mkdir -p "$folder/windows-archive"
  (cd build/windows && cpack -G ZIP -D CPACK_CMAKE_GENERATOR=Ninja -B "$OLDPWD/$folder/windows-archive" > /dev/null)
  (cd "$folder/windows-archive" && cmake -E tar xf npt-*.zip && rm -rf _CPack_Packages && ls -sh npt-*.zip)
  wrapped npt-archive /usr/lib/wine/wine64 "$(realpath "$folder"/windows-archive/npt-*/bin/npt.exe)"
  commands archive "$folder/npt-archive"
}

# The program for every x86-64 processor gives, with the set that it picks, by the network the bits of the program compiled for this
# machine. Through bodies only where it was compiled with the same instructions: for a Zen 4 without AVX-512, whose own tuning joins
# other products with sums than AVX2's set does, 3.7e-8 of the height lie between them.
multi-isa() {
  [ -z "$quick" ] || { echo "multi-isa: it is built in a quarter of an hour (tests/platforms.sh multi-isa does)"; return 77; }
  cmake --preset multi-isa > "$folder/multi-isa.txt"
  cmake --build --preset multi-isa >> "$folder/multi-isa.txt" 2>&1 || { tail -40 "$folder/multi-isa.txt" >&2; return 1; }
  commands multi-isa build/multi-isa/bin/npt
  cmp "$folder/native.ply" "$folder/multi-isa-program/network.ply"
  echo "by the network the same bits as the program that is compiled for this machine"
  build/multi-isa/bin/npt doctor | grep -i "compiled" || true
}

mpi() {
  [ -z "$quick" ] || [ -x build/mpi/bin/npt ] || { echo "mpi: its program is built in minutes (tests/platforms.sh mpi does)"; return 77; }
  bash tests/platforms/mpi.sh
}

deb() {
  bash tests/platforms/deb.sh "$native_build"
  [ -z "$quick" ] || return 0
  bash tests/platforms/ports.sh
}

python() { bash tests/platforms/python.sh "$native_build" "$have"; }

blender() { bash tests/platforms/blender.sh "$native_build" "$have"; }

wasm() { bash tests/platforms/wasm.sh "$native_build"; }

failed=()
for name in "${names[@]}"; do
  echo "== $name"
  if [ "$name" != portable ] && [ "$name" != multi-isa ]; then
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
    77) echo "$name: skipped"; [ "${#names[@]}" -gt 1 ] || exit 77 ;;
    *) echo "$name: FAILED"; failed+=("$name") ;;
  esac
done
[ "${#failed[@]}" -eq 0 ] || { echo "platforms.sh: failed: ${failed[*]}" >&2; exit 1; }
