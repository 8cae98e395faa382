#!/usr/bin/env bash
# The Debian package of a build: made by cpack, unpacked, its program run from there, looked at by lintian.
# usage: tests/platforms/deb.sh [BUILD FOLDER]     without: build/release
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

build=$(realpath "${1:-build/release}")
folder=build/platforms/deb
rm -rf "$folder" && mkdir -p "$folder"
(cd "$build" && cpack -G DEB -B "$OLDPWD/$folder" > /dev/null)
package=$(ls "$folder"/npt_*.deb)
dpkg-deb --info "$package" | sed -n '/Package:/,/Description:/p'
dpkg -x "$package" "$folder/root"
root="$folder/root/usr"
for file in bin/npt include/npt/npt.hpp share/cmake/npt/npt-config.cmake share/npt/weights/human.safetensors \
  share/man/man1/npt.1.gz share/bash-completion/completions/npt share/doc/npt/copyright; do
  [ -e "$root/$file" ] || { echo "deb.sh: $file is not in the package" >&2; exit 1; }
done
man -l "$root/share/man/man1/npt.1.gz" 2> /dev/null | grep -q "transfer" || ! command -v man > /dev/null
bash -c ". $root/share/bash-completion/completions/npt; COMP_WORDS=($root/bin/npt tr) COMP_CWORD=1; _npt
         printf '%s\n' \"\${COMPREPLY[@]}\"" | grep -qx transfer
"$root/bin/npt" generate --out "$folder/a.ply" > /dev/null
"$root/bin/npt" generate --seed 1 --out "$folder/b.ply" > /dev/null
"$root/bin/npt" transfer --identity "$folder/a.ply" --pose "$folder/b.ply" --out "$folder/c.ply"
! command -v lintian > /dev/null || lintian --no-tag-display-limit "$package" | tee "$folder/lintian.txt" | grep "^E:" || true
echo "deb.sh: $(basename "$package"), $(du -h "$package" | cut -f1)"
