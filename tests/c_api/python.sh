#!/usr/bin/env bash
# transfer.py on two meshes, with each of the shipped weights: the program's bits, for a pair, a sequence and a clip.
# usage: python.sh PYTHON NPT LIBRARY PROJECT FOLDER
set -euo pipefail
python=$1 npt=$2 library=$3 project=$4
rm -rf "$5"
mkdir -p "$5/frames"
cd "$5"

transfer() { "$python" -B "$project/examples/c_api/transfer.py" "$@"; }
# Equal positions as 32-bit numbers, whatever the digits.
same() {
  "$python" - "$1" "$2" <<'PYTHON'
import array, sys
def floats(path):
    return array.array("f", (float(word) for line in open(path) if line.startswith("v ") for word in line.split()[1:4]))
a, b = map(floats, sys.argv[1:])
if not a or a != b:
    sys.exit(f"{sys.argv[1]} and {sys.argv[2]} differ")
PYTHON
}

"$npt" generate --out identity.obj --seed 3 --pose rest
"$npt" generate --out frames/0.obj --seed 8 --pose random
"$npt" generate --out frames/1.obj --seed 9 --pose random
for weights in "$project"/examples/weights/*.safetensors; do
  "$npt" transfer --method network --weights "$weights" --identity identity.obj --pose frames/0.obj --out expected.obj
  transfer --method network "$library" "$weights" identity.obj frames/0.obj found.obj
  same found.obj expected.obj
done
weights=$project/examples/weights/human.safetensors
"$npt" transfer --weights "$weights" --identity identity.obj --pose frames --out expected
transfer "$library" "$weights" identity.obj frames/0.obj frames/1.obj found.obj
same found_000.obj expected/0.obj
same found_001.obj expected/1.obj
"$npt" transfer --weights "$weights" --identity frames/0.obj --pose frames --out walk.glb
"$npt" transfer --weights "$weights" --identity identity.obj --pose walk.glb --clip frames --out expected.glb
transfer --clip frames "$library" "$weights" identity.obj walk.glb found.glb
cmp found.glb expected.glb
network=(--method network --pairings 2 --mirror --seed 4)
"$npt" transfer "${network[@]}" --weights "$weights" --identity identity.obj --pose frames/0.obj --out expected.obj
transfer "${network[@]}" "$library" "$weights" identity.obj frames/0.obj found.obj
same found.obj expected.obj
"$npt" transfer --method network --weights "$weights" --identity identity.obj --pose frames/0.obj --out refined.obj --refine
transfer --method network --refine "$library" "$weights" identity.obj frames/0.obj found.obj
same found.obj refined.obj
cmp -s refined.obj expected.obj && { echo "refining changes nothing" >&2; exit 1; }
cmp -s found_000.obj found_001.obj && { echo "two frames are one" >&2; exit 1; }

# Bad input is a message, and leaves no output.
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n' > broken.obj
if transfer "$library" "$weights" identity.obj broken.obj bad.obj 2> message.txt; then exit 1; fi
grep -q "transfer.py: broken.obj: triangle 0: found vertex 8, expected a number below 3" message.txt
[ ! -e bad.obj ]
printf 'ply\nformat ascii 1.0\n' > other.ply
if transfer "$library" "$weights" identity.obj other.ply bad.obj 2> message.txt; then exit 1; fi
grep -q "transfer.py: other.ply: found no vertex, expected an OBJ file" message.txt
printf 'v 0 0 0\nv 1 0\n' > short.obj
if transfer "$library" "$weights" identity.obj short.obj bad.obj 2> message.txt; then exit 1; fi
grep -q "transfer.py: short.obj: line 2: " message.txt
[ ! -e bad.obj ]
