#!/bin/sh
# Counts the tuned numbers of body estimation, skinning and transfer: floating-point constants other than 0, 0.5, 1, 2,
# 3 and 4, and numbers of samples and iterations above 4. Prints each header's count, the greatest first, and the sum.
# Numbers that a script of the project fits, as the line says ("learned by examples/..."), don't count.
# docs/notes/tuned-numbers.md must list as many of each header, with their reasons. With a number as its argument it
# fails where the sum is greater: a new tuned number has to replace another one.
set -eu
cd "$(dirname "$0")/../../include/npt"
find estimate skin transfer mesh/sampled_surface.hpp -name '*.hpp' | LC_ALL=C sort | while read -r header; do
  awk -v header="$header" '
    /learned by examples\// { next }
    {
      sub(/\/\/.*/, ""); gsub(/"[^"]*"/, "")
      line = $0
      while (match(line, /[0-9]*\.?[0-9]+(e[-+]?[0-9]+)?/)) {
        number = substr(line, RSTART, RLENGTH); before = RSTART > 1 ? substr(line, RSTART - 1, 1) : ""
        rest = substr(line, RSTART + RLENGTH)
        floating = number ~ /[.e]/ || (rest ~ /^\./ && rest !~ /^\.\./)
        value = number + 0
        if (before !~ /[A-Za-z_0-9.]/ && floating && value != 0 && value != 0.5 && value != 1 && value != 2 &&
            value != 3 && value != 4) count++
        line = rest
      }
      if ($0 ~ /(constexpr|std::size_t|int|\.[a-z_]+) ?[a-z_]* = [0-9]+[;,}]/ || $0 ~ /^ *\.[a-z_]+ = [0-9]+[,}]/) {
        line = $0
        while (match(line, / = [0-9]+[;,}]/)) {
          if (substr(line, RSTART + 3, RLENGTH - 4) + 0 > 4) count++
          line = substr(line, RSTART + RLENGTH)
        }
      }
    }
    END { if (count) print count, header }' "$header"
done | sort -k1,1nr -k2 | awk -v most="${1:-}" -v table=../../docs/notes/tuned-numbers.md '
  BEGIN {
    while ((getline line < table) > 0)
      if (split(line, cell, " *[|] *") > 4 && cell[2] ~ /^`/) {
        gsub(/`/, "", cell[2])
        listed[cell[2]] += split(cell[3], number, ", ")
      }
  }
  {
    print; sum += $1
    if ($1 != listed[$2]) { print table " lists " listed[$2] + 0 " of " $2; bad = 1 }
    delete listed[$2]
  }
  END {
    print sum, "in all"
    for (header in listed) { print table " lists " header ", which has none"; bad = 1 }
    if (most != "" && sum > most) { print "expected at most " most; bad = 1 }
    exit bad
  }'
