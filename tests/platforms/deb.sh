#!/usr/bin/env bash
# The Debian package of a build: made by cpack, installed by dpkg below a folder, its program run and a project built from there; no errors
# of lintian's.
# usage: tests/platforms/deb.sh [BUILD FOLDER [PACKAGE]]     without: build/release
#   PACKAGE   this one, instead of one that cpack makes
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

build=$(realpath "${1:-build/release}")
folder=build/platforms/deb
rm -rf "$folder" && mkdir -p "$folder"
[ -n "${2:-}" ] || (cd "$build" && cpack -G DEB -B "$OLDPWD/$folder" > /dev/null)
package=${2:-$(ls "$folder"/npt_*.deb)}
dpkg-deb --info "$package" | sed -n '/Package:/,/Description:/p'
# Below a folder that has none of the packages that it depends on, as they are installed here.
mkdir -p "$folder/root/var/lib/dpkg/info" "$folder/root/var/lib/dpkg/updates"
touch "$folder/root/var/lib/dpkg/status"
dpkg --root="$folder/root" --log="$folder/dpkg.log" --force-not-root --force-depends --force-bad-path -i "$package" 2> "$folder/dpkg.txt" || { cat "$folder/dpkg.txt" >&2; exit 1; }
root="$(realpath "$folder")/root/usr"
for file in bin/npt include/npt/npt.hpp share/cmake/npt/npt-config.cmake share/npt/weights/human.safetensors \
  share/man/man1/npt.1.gz share/bash-completion/completions/npt share/doc/npt/copyright share/doc/npt/NOTICE; do
  [ -e "$root/$file" ] || { echo "deb.sh: $file is not in the package" >&2; exit 1; }
done
man -l "$root/share/man/man1/npt.1.gz" 2> /dev/null | grep -q "transfer" || ! command -v man > /dev/null
bash -c ". $root/share/bash-completion/completions/npt; COMP_WORDS=($root/bin/npt tr) COMP_CWORD=1; _npt
         printf '%s\n' \"\${COMPREPLY[@]}\"" | grep -qx transfer
"$root/bin/npt" generate --out "$folder/a.ply" > /dev/null
"$root/bin/npt" generate --seed 1 --out "$folder/b.ply" > /dev/null
"$root/bin/npt" transfer --identity "$folder/a.ply" --pose "$folder/b.ply" --out "$folder/c.ply"
cmake -S tests/consumers/find_package -B "$folder/consumer" -DCMAKE_BUILD_TYPE=Debug "-Dnpt_DIR=$root/share/cmake/npt" > "$folder/consumer.txt"
cmake --build "$folder/consumer" >> "$folder/consumer.txt" 2>&1 || { tail -20 "$folder/consumer.txt" >&2; exit 1; }
"$folder/consumer/consumer"
if command -v lintian > /dev/null; then
  lintian --tag-display-limit 0 "$package" > "$folder/lintian.txt" 2> /dev/null || true
  ! grep "^E:" "$folder/lintian.txt" || exit 1
  echo "lintian: no errors, $(grep -c "^W:" "$folder/lintian.txt" || true) warnings"
else
  echo "lintian: not installed, not run"
fi
echo "deb.sh: $(basename "$package"), $(du -h "$package" | cut -f1)"
