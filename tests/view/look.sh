#!/usr/bin/env bash
# usage: look.sh NODE CHROMIUM NODE_MODULES PROGRAM FOLDER SHARED
# Finds what look.mjs needs and runs it, or says what is missing.
set -uo pipefail
node=$1 chromium=$2

[ -x "$node" ] || { echo "SKIPPED: node is not installed"; exit 0; }
[ -x "$chromium" ] || { echo "SKIPPED: Chromium is not installed"; exit 0; }
export NODE_PATH="$3:${NODE_PATH:-}"
library=$("$node" -p 'require.resolve("playwright-core")' 2> /dev/null)
[ -n "$library" ] || { echo "SKIPPED: npm's playwright-core is not there (cmake/install-dependencies.sh --browser)"; exit 0; }
validate=$(realpath "$(dirname "$0")/../gltf/validate.js")
"$node" -e 'require("gltf-validator")' 2> /dev/null || validate=
rm -rf "$5"
exec "$node" "$(dirname "$0")/look.mjs" "$library" "$chromium" "$4" "$5" "$6" $validate
