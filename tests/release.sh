#!/usr/bin/env bash
# Makes what users take of npt, each piece from this commit, and uses each where nothing else of npt is: the first steps of its guide.
# Leaves in build/artefacts the pieces, SHA256SUMS, and what is in them with its licences (SPDX 2.3). Publishes nothing.
# usage: tests/release.sh [--have] [--pack] [source] [deb] [windows] [wheel] [blender] [npm] [site]
#   without names: all, one after another; an hour and more where nothing is built yet
#   --have   installs no tools: a piece that lacks its own is left out, and named at the end; with one name that is status 77
#   --pack   makes the pieces, and doesn't use them
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

have='' only_pack='' names=()
while [ "$#" -gt 0 ]; do
  case "$1" in
    --have) have=--have ;;
    --pack) only_pack=yes ;;
    source | deb | windows | wheel | blender | npm | site) names+=("$1") ;;
    -h | --help) sed -n '2,7s/^# //p' "$0"; exit 0 ;;
    *) echo "release.sh: unknown argument '$1'; --help lists what is known" >&2; exit 2 ;;
  esac
  shift
done
[ "${#names[@]}" -ne 0 ] || names=(source deb windows wheel blender npm site)

commit=$(git rev-parse HEAD 2> /dev/null) || { echo "release.sh: this is no git repository: a release is made of a commit" >&2; exit 1; }
git diff --quiet HEAD -- || { echo "release.sh: files differ from the commit: commit or stash them (git status names them)" >&2; exit 1; }
native=build/release
[ -x "$native/bin/npt" ] || { echo "release.sh: $native/bin/npt is missing: cmake --preset release && cmake --build --preset release" >&2; exit 1; }

. cmake/jobs.sh
. tests/release/clean.sh
version=$(cmake/version.sh)
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH
out=$PWD/build/artefacts work=build/clean
mkdir -p "$out" "$work"
# What another commit left would stand beside this one's.
[ "$(cat "$work/commit" 2> /dev/null)" = "$commit" ] || rm -f "$out"/*
echo "$commit" > "$work/commit"

# Its tools, as cmake/platform-packages.sh names them; the clean Debian isn't among them, since there is another way without.
tools() {
  local tool
  case "$1" in
    source) return 0 ;;
    deb) set -- deb ;;
    wheel) set -- python ;;
    npm) set -- wasm ;;
    site) set -- wasm site ;;
  esac
  for tool in "$@"; do cmake/platform-packages.sh "$tool" $have || return 1; done
  case "$1" in wasm) command -v npm > /dev/null || { echo "npm is missing: cmake/install-dependencies.sh --browser" >&2; return 1; } ;; esac
}

file_of() {
  case "$1" in
    source) echo "npt-$version.tar.gz" ;;
    deb) echo "npt_${version}_$(dpkg --print-architecture).deb" ;;
    windows) echo "npt-$version-win64.zip" ;;
    wheel) echo "npt-$version-py3-none-*.whl" ;;
    blender) echo "npt_pose_transfer-$version.zip" ;;
    npm) echo "npt-web-$version.tgz" ;;
    site) echo "npt-site-$version.tar.gz" ;;
  esac
}
# The one file of a piece.
artefact() {
  # shellcheck disable=SC2086
  (cd "$out" && set -- $(file_of "$1") && [ "$#" = 1 ] && [ -s "$1" ] && echo "$out/$1") || { echo "release.sh: no $(file_of "$1")" >&2; return 1; }
}

# ---- Making ----

# built NAME COMMAND...: its output is shown where it fails. Functions join their steps by &&, since set -e doesn't hold in here.
built() {
  local log="$work/$1.txt"
  shift
  "$@" > "$log" 2>&1 || { tail -40 "$log" >&2; return 1; }
}
preset() { cmake --preset "$1" && cmake --build --preset "$1"; }
# Under another generator's name cpack leaves out its own build step, which would build the tests, too.
packed() {  # PRESET GENERATOR PATTERN
  local folder="$PWD/$work/cpack-$1"
  rm -rf "$folder" && mkdir -p "$folder" && (cd "build/$1" && cpack -G "$2" -D CPACK_CMAKE_GENERATOR=Ninja -B "$folder") &&
    rm -rf "$folder/_CPack_Packages" && mv "$folder"/$3 "$out"
}

pack_source() { git archive --prefix="npt-$version/" HEAD | gzip -9n > "$out/$(file_of source)"; }
pack_deb() { built deb-build preset multi-isa && built deb packed multi-isa DEB "npt_*.deb"; }
pack_windows() { built windows-build preset windows && built windows packed windows ZIP "npt-*.zip"; }
pack_wheel() { built wheel examples/python/build_wheel.sh --build "$native" "$out"; }
pack_blender() {
  built blender examples/blender/build_zip.sh --build "$native" "$work/blender"
  mv "$work/blender/npt_pose_transfer.zip" "$out/$(file_of blender)"
}
pack_npm() {
  built npm examples/web/build.sh
  (cd build/web/package && npm pack --silent --pack-destination "$out") > /dev/null
}
pack_site() {
  built web examples/web/build.sh
  built site docs/site.sh
  ! grep "^left out" "$work/site.txt" || { echo "release.sh: the site is not whole: build/clean/site.txt names what brings the rest" >&2; return 1; }
  tar --sort=name --mtime="@$SOURCE_DATE_EPOCH" --owner=0 --group=0 --numeric-owner --transform "s|^site|npt-site-$version|" -C build -c site |
    gzip -9n > "$out/$(file_of site)"
}

# ---- Using, where nothing else of npt is ----

# block GUIDE HEADING LANGUAGE: the first block of that language below the heading.
block() {
  awk -v heading="$2" -v language="$3" '
    /^```/ && inside { if (found) exit; inside = 0; next }
    /^```/ { inside = 1; found = below && substr($0, 4) == language; next }
    !inside && /^#/ { below = $0 == heading }
    inside && found { print }' "$1" | grep . || { echo "release.sh: $1 has no block of $3 below '$2'" >&2; return 1; }
}
animation="## 2. Try it with files that come along"

# The sources: the README's demo, from packages to a picture.
try_source() {
  local root="$work/source" demo
  if clean_debian source g++ cmake make; then
    tar -xzf "$(artefact source)" -C "$root/srv"
    built source-demo inside "$root" sh -c "cd /srv/npt-$version && examples/demo.sh"
    demo="$root/srv/npt-$version/build/demo"
  else
    rm -rf "$root" && mkdir -p "$root"
    tar -xzf "$(artefact source)" -C "$root"
    built source-demo env -i HOME="$PWD/$root" PATH="$PATH" "$root/npt-$version/examples/demo.sh"
    demo="$root/npt-$version/build/demo"
  fi
  tail -1 "$work/source-demo.txt"
  [ -s "$demo/result.obj" ] && [ -s "$demo/demo.png" ]
  rm -rf "$root"
}

# The Debian package: below a folder and as a dependency of a project, then by apt with what it depends on.
try_deb() {
  local root="$work/deb"
  bash tests/platforms/deb.sh build/multi-isa "$(artefact deb)" | tail -2
  if clean_debian deb; then
    cp "$(artefact deb)" "$root/srv"
    built deb-install inside "$root" apt-get install -y -qq --no-install-recommends "/srv/$(file_of deb)"
    mkdir -p "$root/srv/npt/examples"
    cp examples/animate.sh "$root/srv/npt/examples"
    block docs/quickstart-artist.md "$animation" sh > "$root/srv/first.sh"
    built deb-first inside "$root" env NPT=/srv/npt sh -ec 'npt --version; cd; . ./first.sh'
    said deb-first "npt $version" "24 frames of walk on its own 40 joints"
    [ -s "$root/srv/try/result.glb" ] && [ -s "$root/srv/try/result.html" ]
    rm -rf "$root"
  fi
}
# said NAME TEXT...: the log has each of these.
said() {
  local log="$work/$1.txt" text
  shift
  for text in "$@"; do grep -F -- "$text" "$log" | head -1 || { echo "release.sh: $log lacks '$text'" >&2; return 1; }; done
}

# The Windows archive, in wine with a user of its own.
try_windows() {
  local root="$PWD/$work/windows"
  rm -rf "$root" && mkdir -p "$root/bin"
  (cd "$root" && cmake -E tar xf "$(artefact windows)")
  export WINEPREFIX="$root/wine" WINEDEBUG=-all LC_ALL=C.UTF-8
  printf '#!/bin/sh\nexec /usr/lib/wine/wine64 "%s" "$@"\n' "$(echo "$root"/npt-*/bin/npt.exe)" > "$root/bin/npt"
  chmod +x "$root/bin/npt"
  block docs/quickstart-artist.md "$animation" sh > "$root/first.sh"
  built windows-first env NPT="$PWD" FRAMES=6 PATH="$root/bin:$PATH" sh -ec "npt --version; cd '$root'; . ./first.sh"
  said windows-first "npt $version" "6 frames of walk on its own 40 joints"
  [ -s "$root/try/result.glb" ]
  rm -rf "$root"
}

# The wheel, in a virtual environment with the system's numpy: its tests, then the guide's first steps.
try_wheel() {
  local root="$PWD/$work/wheel" guide=docs/quickstart-python.md python="$PWD/build/platforms/python/venv/bin/python"
  bash tests/platforms/python.sh "$native" "$(artefact wheel)" 2>&1 | grep -E "^(Ran|OK|FAILED|python.sh)"
  rm -rf "$root" && mkdir -p "$root"
  block "$guide" "## 2. Two meshes" sh > "$root/meshes.sh"
  { block "$guide" "## 2. Two meshes" python; block "$guide" "## 3. The transfer" python; echo 'print("npt", npt.__version__)'; } > "$root/first.py"
  (cd "$root" && PATH="$OLDPWD/$native/bin:$PATH" sh -e meshes.sh > /dev/null && env -i "$python" first.py) > "$work/wheel-first.txt"
  said wheel-first "(6890, 3) float32" "npt $version"
  rm -rf "$root"
}

# The add-on, in Blender without a user's settings.
try_blender() { bash tests/platforms/blender.sh "$native" "$(artefact blender)" 2>&1 | grep -E "^(Ran|OK|FAILED|Blender [0-9]|blender.sh)"; }

# The package, installed into an empty folder without a registry.
try_npm() {
  local root="$PWD/$work/npm"
  rm -rf "$root" && mkdir -p "$root"
  cp tests/release/first.mjs "$root"
  (cd "$root" && npm install --silent --offline --no-audit --no-fund --ignore-scripts "$(artefact npm)") > /dev/null
  (cd "$root" && node first.mjs) > "$work/npm-first.txt"
  said npm-first "npt $version" "by body, person"
  built npm-package node tests/web/package.mjs "$root/node_modules/npt-web" "$native/bin/npt" "$root/test"
  tail -1 "$work/npm-package.txt"
  rm -rf "$root"
}

# The site, from a static server: each page and each file that it names.
try_site() {
  local root="$work/site"
  rm -rf "$root" && mkdir -p "$root"
  tar -xzf "$(artefact site)" -C "$root"
  python3 -B tests/release/check_site.py "$root/npt-site-$version"
  rm -rf "$root"
}

# ---- All of it ----

left_out=() failed=() made=()
for name in "${names[@]}"; do
  echo "== $name"
  if ! tools "$name" > "$work/tools.txt" 2>&1; then
    [ -n "$have" ] || { cat "$work/tools.txt" >&2; failed+=("$name"); continue; }
    echo "$name: left out, its tools are not installed (tests/release.sh $name installs them)"
    left_out+=("$name")
    continue
  fi
  set +e  # not `if (...)`: within a condition a failing command would not end the piece
  (
    set -e
    (cd "$out" && rm -f $(file_of "$name"))
    "pack_$name"
    file=$(artefact "$name")
    echo "made: $(basename "$file"), $(du -h "$file" | cut -f1)"
    [ -n "$only_pack" ] || "try_$name"
  )
  status=$?
  set -e
  if [ "$status" = 0 ]; then
    made+=("$name")
    [ -n "$only_pack" ] || echo "$name: passed"
  else
    echo "$name: FAILED"
    failed+=("$name")
  fi
done

python3 -B tests/release/spdx.py "$version" "$commit" "$out"
(cd "$out" && rm -f SHA256SUMS && sha256sum -- * > ../clean/SHA256SUMS && mv ../clean/SHA256SUMS . && sha256sum --quiet -c SHA256SUMS)
echo "== build/artefacts"
(cd "$out" && ls -s --block-size=KB -- *)
[ "${#left_out[@]}" -eq 0 ] || echo "release.sh: left out for want of their tools: ${left_out[*]}"
[ "${#failed[@]}" -eq 0 ] || { echo "release.sh: failed: ${failed[*]}" >&2; exit 1; }
[ "${#made[@]}" -ne 0 ] || exit 77
