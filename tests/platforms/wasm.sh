#!/usr/bin/env bash
# The web package and its page: built by emscripten, the package in node and the page in headless Chromium held against the program's results.
# Without Chromium or npm's packages (cmake/install-dependencies.sh --browser) the page is left out, and named as such.
# usage: tests/platforms/wasm.sh [BUILD FOLDER] [IMAGES]
#   BUILD FOLDER  of this machine's program (default build/release)
#   IMAGES        where the pictures of the docs are written anew (docs/images)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

program=$(realpath "${1:-build/release}")/bin/npt
out=build/platforms/wasm
examples/web/build.sh "$out"
node tests/web/package.mjs "$out/package" "$program" "$out/test-package"
node tests/web/worker.mjs "$out" "$program" "$out/test-worker"
# At most 1.2 MB gzipped without weights and what is fetched for FBX files, for whom a plain server serves.
size=$(find "$out/page" -type f ! -path '*/weights/*' ! -name 'npt-threads.*' ! -name fbx.min.js -exec gzip -9c {} + | wc -c)
echo "the page without weights: $((size / 1000)) KB gzipped"
[ "$size" -le 1200000 ] || { echo "wasm.sh: more than 1.2 MB" >&2; exit 1; }

chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
modules=$PWD/build/npm/node_modules
if [ -z "$chromium" ] || [ ! -d "$modules/playwright-core" ] || [ ! -d "$modules/axe-core" ]; then
  echo "the page: skipped, Chromium or npm's packages are not there (cmake/install-dependencies.sh --browser)"
  exit
fi
node tests/web/look.mjs "$modules" "$chromium" "$out" "$program" "$out/test-page" "${2:-$out/test-page}"
