#!/usr/bin/env bash
# Makes three.min.js and LICENSE again from npm's packages, in these versions. Needs node and npm; everything else happens in a
# temporary folder.
set -euo pipefail
three=0.187.0
esbuild=0.28.2

here=$(cd "$(dirname "$0")" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cp "$here/three.js" "$folder/entry.js"
cd "$folder"
echo '{"private": true}' > package.json
npm install --no-audit --no-fund --save-exact "three@$three" "esbuild@$esbuild"
npx esbuild entry.js --bundle --minify --format=iife --global-name=THREE --target=es2020 --legal-comments=none \
  --banner:js="/* three.js $three, MIT licence, Copyright 2010-2026 three.js authors; bundled by bundle.sh */" \
  --outfile=three.min.js
# A page holds the script in an element of its own.
if grep -qi '</script' three.min.js; then
  echo "three.min.js would end its element" >&2
  exit 1
fi
cp three.min.js "$here/three.min.js"
cp node_modules/three/LICENSE "$here/LICENSE"
