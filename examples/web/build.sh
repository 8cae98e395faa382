#!/usr/bin/env bash
# The page and its npm package: npt in WebAssembly, by Debian's emscripten. Leaves the package in OUT/package and the page, for any static
# server, in OUT/page. Needs emcc, node and the headers of npt's dependencies (cmake/platform-packages.sh wasm installs all).
# usage: examples/web/build.sh [OUT]        without: build/web
set -euo pipefail

case "${1:-}" in
  -h | --help) sed -n '2,4s/^# //p' "$0"; exit 0 ;;
  -*) echo "build.sh: unknown option '$1' (usage: examples/web/build.sh [OUT])" >&2; exit 2 ;;
esac
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
here=$root/examples/web
mkdir -p "${1:-$root/build/web}"
out=$(cd "${1:-$root/build/web}" && pwd)
for tool in emcc node; do
  command -v "$tool" > /dev/null || { echo "build.sh: $tool is missing: cmake/platform-packages.sh wasm" >&2; exit 1; }
done

# Headers only, out of the system's folder, whose other headers are of this machine.
include=$out/include
mkdir -p "$include" "$out/objects" "$out/package/weights"
for header in Eigen:eigen3/Eigen tiny_obj_loader.h; do
  [ -e "/usr/include/${header#*:}" ] || { echo "build.sh: /usr/include/${header#*:} is missing: cmake/install-dependencies.sh" >&2; exit 1; }
  ln -sfn "/usr/include/${header#*:}" "$include/${header%%:*}"
done

# Emscripten's own scripts find their modules there, also by a node that isn't Debian's.
export NODE_PATH="/usr/share/nodejs${NODE_PATH:+:$NODE_PATH}"
# The compiler's own vectors: 1.5 times as fast as xsimd on SSE intrinsics that emscripten translates.
# Without superword vectors: emscripten 3.1.6 makes them of x and y of some 3x3 products, and writes wrong ones (measured: joints off by
# 20 % of the height).
flags=(-std=c++20 -O3 -DNDEBUG -DNPT_NO_TBB -DNPT_PORTABLE_SIMD -msimd128 -fno-slp-vectorize -fwasm-exceptions -Wall -Wextra
  -I"$root/include" -I"$root/examples/npt" -isystem "$include" -include "$here/source/standard_library.hpp")
# Its units stand in a list, which a test links with this machine's compiler, too.
mapfile -t sources < <(sed "s|^|$root/|" "$here/source/units.txt")

# What is small beside the networks needn't be fast: motions and readers at -Os are 58 KB gzipped less of the page.
optimised() { case "$(basename "$1")" in npt_web_motion.cpp | motion.cpp | read.cpp | off.cpp | libraries.cpp) echo -Os ;; esac; }

# build NAME LINKING FLAG...: OUT/objects/NAME/npt-NAME.js and .wasm, with these flags besides, and LINKING where it is linked. Only what is
# older than a source or a header, or made with other flags, is compiled.
build() {
  local name=$1 linking=$2 folder=$out/objects/$1 source object objects=() running=()
  shift 2
  mkdir -p "$folder"
  [ "$(cat "$folder/flags" 2> /dev/null)" = "${flags[*]} $*" ] || rm -f "$folder"/*.o
  printf '%s' "${flags[*]} $*" > "$folder/flags"
  for source in "${sources[@]}"; do
    object=$folder/$(basename "$source" .cpp).o
    objects+=("$object")
    [ -e "$object" ] && [ -z "$(find "$root/include" "$here/source" "$root/examples/npt/formats" -newer "$object" -print -quit)" ] && continue
    echo "Compiling $(basename "$source") ($name)"
    (emcc "${flags[@]}" $(optimised "$source") "$@" -c "$source" -o "$object.part" && mv "$object.part" "$object") &
    running+=($!)
  done
  for one in "${running[@]}"; do wait "$one"; done
  # -Oz is for the linker's own passes: 25 KB gzipped less than -O3; code was compiled above.
  emcc -Oz -fwasm-exceptions -msimd128 "$@" $linking "${objects[@]}" -o "$folder/npt-$name.js" --no-entry -Wno-pthreads-mem-growth \
    -sMODULARIZE -sEXPORT_ES6 -sEXPORT_NAME=createNpt -sENVIRONMENT=web,worker -sFORCE_FILESYSTEM \
    -sALLOW_MEMORY_GROWTH -sABORTING_MALLOC=0 -sINITIAL_MEMORY=33554432 -sMAXIMUM_MEMORY=2147483648 \
    -sEXPORTED_FUNCTIONS=_malloc,_free -sEXPORTED_RUNTIME_METHODS=FS,UTF8ToString,stringToUTF8,lengthBytesUTF8
}
build single ""
# For pages whose server lets them share memory between workers. The package says how many threads the pool has.
build threads '-sPTHREAD_POOL_SIZE=Module["pool"]' -pthread -DNPT_DEFAULT_THREADS

cp "$here"/package/* "$root/LICENSE" "$out/package/"
sed -i "s|^  \"name\": .*|&\n  \"version\": \"$("$root/cmake/version.sh")\",|" "$out/package/package.json"
"$root/cmake/packages/notices.sh" npm > "$out/package/NOTICE.txt"
cp "$out"/objects/*/npt-*.{js,wasm} "$out/package/"
for weights in human human-pooled quadruped; do
  file=$out/package/weights/$weights.safetensors
  [ "$file" -nt "$root/examples/weights/$weights.safetensors" ] && [ "$file" -nt "$here/halve.mjs" ] ||
    node "$here/halve.mjs" "$root/examples/weights/$weights.safetensors" "$file"
done

rm -rf "$out/page"
mkdir -p "$out/page/npt"
cp "$here"/page/* "$root"/examples/npt/view/{base.css,stage.js,three/three.min.js,three/fbx.min.js} "$out/page/"
cp "$out"/package/{index.js,npt-single.js,npt-single.wasm,npt-threads.js,npt-threads.worker.js,npt-threads.wasm,LICENSE,NOTICE.txt} "$out/page/npt/"
# Its scripts without lines of comments and indentation: 3.6 KB of the 1.2 MB that a page may have, gzipped.
sed -i -E '/^[[:space:]]*\/\//d; s/^[[:space:]]+//' "$out"/page/{page,stage,worker}.js "$out/page/npt/index.js"
cp -r "$out/package/weights" "$out/page/weights"

packed() { cat "$@" | gzip -9 | wc -c; }
kilobytes() { echo $(($(packed "$@") / 1000)); }
echo "page $out/page, gzipped: $(kilobytes "$out"/page/npt/npt-single.*) KB of WebAssembly for one thread, $(kilobytes "$out"/page/npt/npt-threads.*) KB for several," \
  "$(kilobytes $(find "$out/page" -maxdepth 1 -type f ! -name fbx.min.js) "$out/page/npt/index.js") KB of everything else," \
  "$(kilobytes "$out"/page/weights/human.safetensors) KB of weights, $(kilobytes "$out/page/fbx.min.js") KB for FBX"
