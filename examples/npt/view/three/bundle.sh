#!/usr/bin/env bash
# Makes three.min.js, fbx.min.js and LICENSE again from npm's packages, in these versions. Needs node and npm; everything else
# happens in a temporary folder.
set -euo pipefail
three=0.187.0
fflate=0.8.3  # that three.js brings along, for its licence
esbuild=0.28.2

here=$(cd "$(dirname "$0")" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cp "$here/three.js" "$here/fbx.js" "$folder/"
cd "$folder"
echo '{"private": true}' > package.json
npm install --no-audit --no-fund --save-exact "three@$three" "esbuild@$esbuild" "fflate@$fflate"
grep -q "version $fflate" node_modules/three/examples/jsm/libs/fflate.module.js
banner="three.js $three, MIT licence, Copyright 2010-2026 three.js authors"
bundle() {
  npx esbuild "$1.js" --bundle --minify --target=es2020 --legal-comments=none --banner:js="/* $2; bundled by bundle.sh */" \
    --outfile="$1.min.js" "${@:3}"
}
bundle three "$banner" --format=iife --global-name=THREE
bundle fbx "$banner; fflate $fflate, MIT licence, Copyright 2026 Arjun Barrett" --format=esm
# A page holds the script in an element of its own.
if grep -qi '</script' three.min.js; then
  echo "three.min.js would end its element" >&2
  exit 1
fi
cp three.min.js fbx.min.js "$here/"
{ cat node_modules/three/LICENSE; printf '\nfbx.min.js also holds fflate:\n\n'; cat node_modules/fflate/LICENSE; } > "$here/LICENSE"
