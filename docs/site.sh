#!/usr/bin/env bash
# Makes a static site of the guides, without a foreign host: guides and what they link to, the generated API, the page that
# transfers poses in a browser. What a missing tool leaves out is said. cmake/install-dependencies.sh --docs installs all tools.
# usage: docs/site.sh [OUT]        without: build/site
#   MERMAID   in the environment: a mermaid.min.js of yours, instead of the one that npm brings
set -euo pipefail

case "${1:-}" in
  -h | --help) sed -n '2,5s/^# //p' "$0"; exit 0 ;;
  -*) echo "site.sh: unknown option '$1' (usage: docs/site.sh [OUT])" >&2; exit 2 ;;
esac
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=$(realpath -m "${1:-$root/build/site}")
install="cmake/install-dependencies.sh --docs"

python=
for candidate in python3 /usr/bin/python3; do
  if "$candidate" -c 'import markdown_it, pygments' 2> /dev/null; then
    python=$candidate
    break
  fi
done
[ -n "$python" ] || { echo "site.sh: python3 with markdown-it and pygments is missing: $install" >&2; exit 1; }

if [ -e "$out" ] && [ ! -e "$out/assets/site.css" ] && [ -n "$(ls -A "$out")" ]; then
  echo "site.sh: $out holds something else than a site" >&2
  exit 1
fi
rm -rf "$out"
mkdir -p "$out/assets"
parts=()

# The API as the target docs makes it, but for a folder of its own; a warning is no reason for no site.
if command -v doxygen > /dev/null; then
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  version=$("$root/cmake/version.sh")
  sed -e "s|@PROJECT_SOURCE_DIR@|$root|g; s|@PROJECT_BINARY_DIR@/docs|$work|g; s|@PROJECT_VERSION@|$version|" \
    -e "s|@PROJECT_DESCRIPTION@|Neural pose transfer for meshes|; s|^\(WARN_AS_ERROR *= \).*|\1NO|" \
    "$root/docs/Doxyfile.in" > "$work/Doxyfile"
  (cd "$root" && doxygen "$work/Doxyfile") > "$work/log" 2>&1 || { tail -n 5 "$work/log" >&2; exit 1; }
  cp -r "$work/html" "$out/api"
  parts+=(--api)
else
  echo "left out: the generated API, for doxygen is missing ($install)"
fi

page=$root/build/web/page
if [ -f "$page/index.html" ]; then
  cp -rL "$page" "$out/page"
  parts+=(--page)
else
  echo "left out: the page that transfers poses, for build/web/page is missing (examples/web/build.sh)"
fi

# Mermaid in the version that is known, as npm's registry has it, once.
mermaid=${MERMAID:-$root/build/site-tools/mermaid.min.js}
package=mermaid-10.9.3
digest=57cd17d62b1212f01ec082f7c619b3feb566736ec25658dcb1b5b193195625663fd6441ae1738006aa43976a902c62b3a4a9ba59b4df5042889819547c5600af
if [ ! -f "$mermaid" ] && [ -z "${MERMAID:-}" ] && command -v npm > /dev/null; then
  tools=$root/build/site-tools
  mkdir -p "$tools"
  if (cd "$tools" && npm pack --silent "${package%-*}@${package##*-}") > /dev/null 2>&1 &&
    echo "$digest  $tools/$package.tgz" | sha512sum -c --status; then
    tar -xzf "$tools/$package.tgz" -C "$tools" --strip-components=2 package/dist/mermaid.min.js
  fi
  rm -f "$tools/$package.tgz"
fi
if [ -f "$mermaid" ]; then
  cp "$mermaid" "$out/assets/mermaid.min.js"
  parts+=(--mermaid)
else
  echo "left out: drawings of diagrams, which stand as text, for npm could not bring Mermaid"
fi

"$root/cmake/packages/notices.sh" site > "$out/NOTICE.txt"
"$python" -B "$root/docs/site/pages.py" "$root" "$out" "${parts[@]}"
echo "site $out/index.html ($(du -sh "$out" | cut -f1)); any static server shows it, such as python3 -m http.server -d $out"
