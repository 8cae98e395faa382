#!/usr/bin/env bash
# usage: look.sh NODE CHROMIUM PLAYWRIGHT_CORE PROGRAM FOLDER SHARED
# Finds what look.mjs needs and runs it, or says what is missing.
set -uo pipefail
node=$1 chromium=$2 library=$3

[ -x "$node" ] || { echo "SKIPPED: node is not installed"; exit 0; }
[ -x "$chromium" ] || { echo "SKIPPED: Chromium is not installed"; exit 0; }
if [ -z "$library" ]; then
  library=$(NODE_PATH="${NODE_PATH:-}:$(npm root --global 2> /dev/null)" "$node" -p 'require.resolve("playwright-core")' 2> /dev/null)
fi
[ -n "$library" ] && [ -e "$library" ] || { echo "SKIPPED: npm's playwright-core is not there (NPT_PLAYWRIGHT_CORE)"; exit 0; }
rm -rf "$5"
exec "$node" "$(dirname "$0")/look.mjs" "$library" "$chromium" "$4" "$5" "$6"
