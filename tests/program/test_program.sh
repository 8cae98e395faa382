#!/usr/bin/env bash
# usage: test_program.sh AREA PROGRAM
# Runs the program in an empty folder, good and bad arguments alike, and checks exit status, output and files.
set -uo pipefail

area=$1
npt=$(realpath "$2")
project=$(realpath "$(dirname "$0")/../..")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 1
failures=0

fail() {
  echo "FAILED line ${BASH_LINENO[1]}: $*"
  sed 's/^/    stdout: /' out.txt
  sed 's/^/    stderr: /' err.txt
  failures=$((failures + 1))
}

# expect STATUS [--out TEXT] [--err TEXT] ... -- ARGUMENT ...: the exit status, and texts that are printed. Every error is a
# message of the program, and none leaves a temporary file.
expect() {
  local status=$1 texts=() actual
  shift
  while [ "$1" != -- ]; do
    texts+=("$1" "$2")
    shift 2
  done
  shift
  "$npt" "$@" > out.txt 2> err.txt
  actual=$?
  [ "$actual" -eq "$status" ] || fail "npt $*: exit status $actual, expected $status"
  set -- "${texts[@]}"
  while [ $# -gt 0 ]; do
    local file=out.txt
    [ "$1" = --err ] && file=err.txt
    grep -qF -- "$2" "$file" || fail "no '$2' on ${1#--}"
    shift 2
  done
  if [ "$status" -ne 0 ]; then
    grep -q '^npt: error: ' err.txt || fail "no message of an error"
  fi
  [ -z "$(find . -name '*.part-*')" ] || fail "a temporary file stays: $(find . -name '*.part-*')"
}

exists() { [ -s "$1" ] || fail "$1 was not written"; }
missing() { [ ! -e "$1" ] || fail "$1 should not be there"; }
same() { cmp -s "$1" "$2" || fail "$1 and $2 differ"; }
different() { ! cmp -s "$1" "$2" || fail "$1 and $2 are the same"; }

# A tetrahedron with texture coordinates, a group and a material; and one of another shape and vertex order.
make_meshes() {
  cat > a.obj <<'END'
mtllib a.mtl
v 0 0 0
v 1 0 0
v 0 1.5 0
v 0 0 1
vt 0 0
vt 1 0
vt 0 1
g first
usemtl skin
f 1/1 3/2 2/3
f 1/1 2/2 4/3
g second
f 2/1 3/2 4/3
f 3/1 1/2 4/3
END
  cat > b.ply <<'END'
ply
format ascii 1.0
element vertex 5
property float x
property float y
property float z
property float heat
element face 6
property list uchar int vertex_indices
end_header
0 0 0 1
1 0 0.1 2
0.2 1 0 3
0 0.1 2 4
1 1 1 5
3 0 2 1
3 0 1 3
3 0 3 2
3 4 1 2
3 4 3 1
3 4 2 3
END
}

# resumes_after_kill ARGUMENT ...: the training that wrote whole.safetensors, on one thread, killed without warning after its first
# checkpoint and resumed without any options, ends with the same bits.
resumes_after_kill() {
  "$npt" train --out killed.safetensors "$@" --threads 1 --checkpoint-every 10 > out.txt 2> err.txt &
  local pid=$!
  while kill -0 $pid 2> /dev/null && [ ! -e killed.checkpoint.safetensors ]; do sleep 0.01; done
  kill -9 $pid 2> /dev/null
  wait $pid 2> /dev/null
  rm -f ./*.part-*
  [ -e killed.safetensors ] && echo "note: the training was over before it could be killed"
  expect 0 -- train --out killed.safetensors --resume --threads 1
  same whole.safetensors killed.safetensors
}

test_arguments() {
  expect 0 --out "npt " -- --version
  expect 0 --out "render" --out "transfer" --out "info" -- --help
  expect 0 --out "Usage: npt render" -- render --help
  # Alone it says what to do first; its first three commands work in an empty folder.
  expect 0 --out "npt --help" --
  sed -n 's/^  npt //p' out.txt | head -3 > first.txt
  [ "$(wc -l < first.txt)" -eq 3 ] || fail "no three commands to begin with"
  while read -r line; do
    expect 0 -- $line
  done < first.txt
  exists result.html
  expect 2 --err "subcommand is required" -- bench
  # Every help fits a terminal, and each option says what happens.
  for command in "" transfer rig view render generate info doctor explain bench "bench forward" "bench transfer" "bench gemm" \
    "bench train" evaluate train reproduce deform skeleton; do
    "$npt" $command --help > out.txt 2> err.txt || continue  # a build without Eigen lacks some
    grep -qE '.{101}' out.txt && fail "npt $command --help: a line of more than 100 columns"
    awk '/^  (-.,)?--/ && ++options { text = substr($0, 35); if (length($0) < 35 || substr($0, 34, 1) != " ") { getline; text = substr($0, 35) }
         if (text !~ /^[A-Z][a-z]+( |$)/ || text ~ /^(Of|The|How|What|A|One|For|Part) /) { print "npt option: " $0; bad = 1 } }
         END { exit bad || !options }' out.txt || fail "npt $command --help: an option that doesn't begin with a verb"
  done
  expect 2 --err "unknown subcommand 'fly'" --err "transfer" -- fly
  expect 2 -- --nonsense
  expect 2 --err "--nonsense" --err "npt info --help" -- info x.ply --nonsense
  expect 2 --err "--out" -- render a.obj
  # A full disk is an error, a reader that has seen enough is none.
  if [ -e /dev/full ]; then
    "$npt" --help > /dev/full 2> err.txt
    [ $? -eq 1 ] || fail "full disk: no error"
  fi
  "$npt" --help 2> err.txt | true
  [ "${PIPESTATUS[0]}" -eq 0 ] && [ ! -s err.txt ] || fail "a closed pipe is reported as an error"
}

test_render() {
  make_meshes
  expect 0 --out "200 x 100 pixels, 2 meshes" -- render a.obj b.ply --out x.png --width 100 --height 100
  exists x.png
  [ "$(head -c 4 x.png | tail -c 3)" = PNG ] || fail "x.png is no PNG"
  expect 0 -- render a.obj b.ply --out y.png --width 100 --height 100
  same x.png y.png
  expect 0 -- render a.obj b.ply --out z.png --width 100 --height 100 --yaw 90
  different x.png z.png
  expect 0 --out "2 meshes" -- render a.obj b.ply --out x.png --width 100 --height 100 --columns 1 --captions "a,b" --colours "blue,#ff0000"
  expect 0 -- render b.ply --out x.png --width 100 --height 100 --heat heat --background transparent
  expect 0 -- render b.ply --out x.png --width 100 --height 100 --distance-to b.ply --view back --up z --no-shadow
  # Grids: captions outside, empty places, finished pictures, colours that say something.
  expect 0 --out "4 meshes" -- render a.obj b.ply a.obj b.ply --out x.png --grid 2 --height 60 --column-captions "a,b" --row-captions "one,two"
  exists x.png
  expect 0 --out "1 mesh" -- render a.obj - y.png --out x.png --grid 2 --height 60
  for colour in index normal; do
    expect 0 -- render a.obj --out "$colour.png" --grid 1 --height 60 --colour $colour
  done
  different index.png normal.png
  sed 's/^1 1 1 5$/1 1.2 1.4 5/' b.ply > moved.ply
  expect 0 -- render b.ply moved.ply --out x.png --grid 2 --height 60 --colour error --truth "b.ply"
  expect 0 -- render b.ply moved.ply --out y.png --grid 2 --height 60 --colour error --truth "-,b.ply" --scale-bar 100
  different x.png y.png
  expect 1 --err "a.obj: found 4 vertices, expected 5 as in b.ply" -- render a.obj --out z.png --colour error --truth b.ply
  expect 1 --err "--truth: found no mesh with a truth" -- render a.obj --out z.png --colour error --truth -
  expect 1 --err "--truth: found 2 entries" -- render a.obj --out z.png --colour error --truth "a.obj,a.obj"
  expect 1 --err "--row-captions: found 2 entries, expected 1, one for each row" -- render a.obj --out z.png --row-captions "a,b"
  expect 2 --err "--truth" -- render a.obj --out z.png --colour error
  expect 2 --err "--grid" -- render a.obj --out z.png --grid 2 --columns 2
  expect 2 --err "--colour" -- render a.obj --out z.png --colour nice
  printf 'no picture' > broken.png
  expect 1 --err "broken.png: found" -- render a.obj broken.png --out z.png
  rm -f ./*.png
  expect 1 --err "none.ply: found no such file" -- render none.ply --out x.png
  expect 1 --err "x.jpg: found extension .jpg, expected .png" -- render a.obj --out x.jpg
  expect 1 --err "nowhere/x.png" -- render a.obj --out nowhere/x.png
  expect 1 --err "--captions: found 3 entries, expected 1" -- render a.obj --out x.png --captions "a,b,c"
  expect 1 --err "--colours: found colour 'pink'" -- render a.obj --out x.png --colours pink
  expect 1 --err "vertex property 'cold'" --err "heat" -- render b.ply --out x.png --heat cold
  expect 1 --err "a.obj: found 4 vertices, expected 5 as in b.ply" -- render a.obj --out x.png --distance-to b.ply
  expect 2 --err "--width" -- render a.obj --out x.png --width many
  expect 2 --err "--view" -- render a.obj --out x.png --view below
  expect 1 --err "expected at most 16384 pixels" -- render a.obj a.obj a.obj --out x.png --width 8000 --height 20
  printf 'ply\nformat ascii 1.0\n' > broken.ply
  expect 1 --err "broken.ply" -- render broken.ply --out x.png
  missing x.png
}

test_generate() {
  expect 0 --out "one.ply: 1 mesh of 6890 vertices" -- generate --out one.ply --seed 5
  expect 0 -- generate --out two.ply --seed 5
  same one.ply two.ply
  expect 0 -- generate --out two.ply --seed 6
  different one.ply two.ply
  expect 0 --out "set: 3 meshes" -- generate --out set --count 3 --seed 5 --format obj
  expect 1 --err "x.fbx: found extension .fbx, expected .ply, .obj or .glb, or a folder" -- generate --out x.fbx
  missing x.fbx
  exists set/body_0000.obj
  exists set/body_0002.obj
  expect 0 -- generate --out more --count 2 --seed 5
  same more/body_0000.ply one.ply
  different more/body_0001.ply one.ply
  expect 0 -- generate --out same --count 2 --same-shape --same-pose
  same same/body_0000.ply same/body_0001.ply
  expect 0 -- generate --out rest.ply --shape zero --pose rest
  printf '0 %.0s' {1..72} > zeros.txt
  expect 0 -- generate --out given.ply --shape "0,0" --pose zeros.txt
  same rest.ply given.ply
  expect 0 -- generate --out shuffled.ply --shape zero --pose rest --shuffle
  different rest.ply shuffled.ply
  expect 0 --out "closed" --out "components" -- info shuffled.ply
  expect 0 -- generate --out natural.ply --pose natural --seed 5
  different natural.ply one.ply
  expect 0 -- generate --out again.ply --pose natural --seed 5
  same natural.ply again.ply
  expect 0 -- generate --out character.ply --proportions --pose natural --seed 5
  different character.ply natural.ply
  expect 0 -- generate --out character.ply --proportions --shape zero --pose rest
  different character.ply rest.ply
  expect 0 -- generate --out dressed.ply --clothes --shape zero --pose rest
  expect 0 --out "components     6" --out "open" -- info dressed.ply
  different dressed.ply rest.ply
  expect 0 -- generate --out dressed.ply --clothes --proportions --pose natural
  expect 1 --err "--shape: found 11 numbers" -- generate --out x.ply --proportions --shape "1,1,1,1,1,1,1,1,1,1,1"
  expect 2 --err "--count" -- generate --out x --count 0
  expect 2 --err "--seed" -- generate --out x --seed -1
  expect 2 --err "--seed" -- generate --out x --seed 99999999999999999999999
  expect 2 --err "--pose-seed" -- generate --out x --pose-seed 1.5
  expect 1 --err "--shape: number 2: found 'b'" -- generate --out x.ply --shape "1,b"
  expect 1 --err "--shape: found 11 numbers" -- generate --out x.ply --shape "1,1,1,1,1,1,1,1,1,1,1"
  expect 1 --err "short.txt" -- generate --out x.ply --pose short.txt
  echo "1 2 3" > short.txt
  expect 1 --err "short.txt: found 3 numbers, expected 72" -- generate --out x.ply --pose short.txt
  expect 1 --err "a file for 2 meshes" -- generate --out x.ply --count 2
  expect 1 --err "none.safetensors" -- generate --out x --body none.safetensors
  expect 1 --err "nowhere" -- generate --out nowhere/deeper
  echo "not a body" > bad.safetensors
  expect 1 --err "bad.safetensors" -- generate --out x --body bad.safetensors
  # Of another kind of body: proportions among the shapes, the kind's own poses.
  local animals=$project/examples/weights/quadruped.safetensors
  expect 0 --out "1 mesh of 5600 vertices" -- generate --body "$animals" --shape zero --pose rest --out animal.ply
  expect 0 -- generate --body "$animals" --proportions --pose random --out wild.ply
  expect 0 -- generate --body "$animals" --shape "0,0,0,0,0,0,0,0,0,1" --pose natural --out longer.ply
  different animal.ply longer.ply
  expect 1 --err "--pose: found random poses for a body of 35 joints" -- generate --body "$animals" --pose wide --out x.ply
  expect 0 --out "four-legged animal by body estimation" -- transfer --identity animal.ply --pose longer.ply --out posed.ply --report r.jsonl
  grep -q '"kind":"four-legged animal"' r.jsonl || fail "the report doesn't say what was recognised"
  expect 0 -- generate --seed 3 --out person.ply
  expect 1 --err "longer.ply: found a pose of the domain 'quadruped', expected one of 'human'" -- transfer --identity person.ply --pose longer.ply --out x.ply
  missing x
  missing x.ply
}

test_info() {
  make_meshes
  expect 0 --out "triangles 4" --out "closed" --out "g 2" --out "texture coordinates" -- info a.obj
  printf 'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 5 5 5\nf 1 2 3 4\n' > quad.obj
  expect 0 --out "quads 1" --out "open: 4 border edges in 1 borders" --out "vertices without face  1" -- info quad.obj
  expect 0 --out "float heat" -- info b.ply
  expect 0 --out '"vertices": 4' --out '"faces": 4' -- info --json a.obj
  [ "$(head -c 1 out.txt)" = "[" ] || fail "no JSON array"
  expect 1 --err "none.obj: found no such file" -- info none.obj
  expect 1 --err "expected a mesh file" -- info a.txt
  : > empty.safetensors
  expect 1 --err "empty.safetensors" -- info empty.safetensors
  for name in tensors.safetensors tensors tensors.ply; do
    make_tensors $name
    expect 0 --out "tensors" --out "U8" -- info $name
  done
  : > empty.ply
  expect 1 --err "empty.ply" -- info a.obj empty.ply
  expect 0 --out "weights of a pose transfer network" --out "pose and identity" -- info "$project/examples/weights/human.safetensors"
}

# A safetensors file with a tensor of one byte.
make_tensors() {
  local header='{"x":{"dtype":"U8","shape":[1],"data_offsets":[0,1]}}'
  printf '%b%s!' "\\x$(printf %02x ${#header})\\0\\0\\0\\0\\0\\0\\0" "$header" > "$1"
}

test_doctor() {
  expect 0 --out "compiled for" --out "hardware threads" --out "tbb" -- doctor
  expect 0 --out '"fused_multiply_add": ' --out '"advice": ' -- doctor --json
  expect 2 --err "extra" -- doctor extra
}

test_explain() {
  expect 0 --out "1024" --out "decoder" -- explain
  expect 0 --out "64" -- explain --bottleneck 64 --feature pooled --order relu_conv
  expect 2 --err "--bottleneck" -- explain --bottleneck 65
  expect 2 --err "--order" -- explain --order backwards
  expect 1 --err "none.safetensors" -- explain --weights none.safetensors
}

test_transfer() {
  make_meshes
  cp a.obj before.obj
  expect 1 --err "a.obj: found a mesh that is not recognised as a person (confidence 0 %)" -- transfer --identity a.obj --pose b.ply --out c.obj
  missing c.obj
  expect 0 --out "c.obj in" -- transfer --method network --identity a.obj --pose b.ply --out c.obj --render c.png --seed 3
  exists c.png
  # The identity's faces, texture coordinates, groups and materials, in their order.
  diff <(grep -E '^(f|g|vt|usemtl) ' a.obj) <(grep -E '^(f|g|vt|usemtl) ' c.obj) > out.txt || fail "c.obj lost something"
  grep -q '^mtllib a.mtl' c.obj || fail "c.obj lost its materials"
  [ "$(grep -c '^v ' c.obj)" -eq 4 ] || fail "c.obj has another number of vertices"
  expect 0 -- transfer --method network --identity a.obj --pose b.ply --out d.obj --seed 3 --threads 1
  same c.obj d.obj
  expect 0 -- transfer --method network --identity a.obj --pose b.ply --out c.ply --invariant --normalise sphere --feature per-vertex
  expect 0 --out "faces by size        triangles 4" -- info c.ply
  same a.obj before.obj
  rm -f c.* d.obj

  mkdir poses
  cp a.obj poses/one.obj
  cp b.ply "poses/two words.ply"
  expect 0 --out "2 meshes" -- transfer --method network --identity a.obj --pose poses --out results
  exists results/one.obj
  exists "results/two words.obj"
  expect 0 --out "2 meshes" -- transfer --method network --identity a.obj --pose poses --out results --format ply
  exists "results/two words.ply"

  # A folder is a sequence: a frame takes the choices of the first one with its faces, alone it makes its own.
  mkdir frames
  cp b.ply frames/1.ply
  sed 's/^1 1 1 5$/2 3 4 5/' b.ply > frames/2.ply
  expect 0 -- transfer --method network --identity a.obj --pose frames --out moved --feature per-vertex --invariant
  expect 0 -- transfer --method network --identity a.obj --pose frames/1.ply --out 1.obj --feature per-vertex --invariant
  same 1.obj moved/1.obj
  expect 0 -- transfer --method network --identity a.obj --pose frames/2.ply --out 2.obj --feature per-vertex --invariant
  different 2.obj moved/2.obj
  rm -rf 1.obj 2.obj

  # A sequence as one GLB that moves, and its clip as poses.
  expect 0 --out "2 frames of frames as morph targets" -- transfer --method network --identity a.obj --pose frames --fps 2 --out moving.glb
  expect 0 --out "frames  0.500 s" --out "2 morph targets" --out "skin" -- info moving.glb
  expect 0 --out "1 frame of frames" -- transfer --method network --identity b.ply --pose moving.glb --time 0.25 --out t.obj
  expect 0 --out "3 frames" -- transfer --method network --identity a.obj --pose moving.glb --clip frames --fps 4 --out clip --format ply
  exists clip/frame_0002.ply
  expect 0 --out "c.glb in" -- transfer --method network --identity moving.glb --pose b.ply --out c.glb
  printf 'HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.04\n0 0 0\n0 0 9\n' > a.bvh
  expect 0 --out "skeleton and clip" --out "joint count  1" --out "25 frames a second" -- info a.bvh
  expect 0 --out 'hips "Hips" 0.85' -- info --bones a.bvh
  printf 'hips -\nhead Hips 0.5\n' > bones.txt
  expect 0 --out 'head "Hips" 0.5' -- info --bones a.bvh --bone-map bones.txt
  printf 'tail Hips\n' > bones.txt
  expect 1 --err "bones.txt: line 1: found 'tail', expected a role" -- info --bones a.bvh --bone-map bones.txt
  expect 0 --out "triangles 4" --out "texture coordinates" -- info c.glb
  expect 1 --err "found no clip 'Walk', expected one of 'frames'" -- transfer --identity a.obj --pose moving.glb --clip Walk --out x.glb
  expect 1 --err "at most 0.5" -- transfer --identity a.obj --pose moving.glb --time 7 --out x.glb
  expect 1 --err "expected .glb or .gltf" -- transfer --identity a.obj --pose b.ply --clip Walk --out x.glb
  expect 1 --err "x.obj: found extension .obj, expected .glb" -- transfer --identity a.obj --pose moving.glb --clip frames --out x.obj
  expect 1 --err "0 clips" -- transfer --identity a.obj --pose c.glb --fps 5 --out x.glb
  head -c 900 moving.glb > cut.glb
  expect 1 --err "cut.glb: byte 8: found a length" -- transfer --identity a.obj --pose cut.glb --out x.glb
  missing x.glb
  # Several sequences, and what comes beside them.
  expect 0 --out "2 frames" -- transfer --method network --identity a.obj --pose moving.glb --clip frames --fps 2 --out m.glb --view m.html --report m.jsonl
  grep -qF '"caption":"result"' m.html || fail "no result on the page"
  grep -qF '"status":"done"' m.jsonl && grep -qF '"frames":2' m.jsonl || fail "report: $(cat m.jsonl)"
  expect 0 --out "nothing to do: 1 was there" -- transfer --method network --identity a.obj --pose moving.glb --clip frames --out m.glb --skip-existing
  mkdir people && cp a.obj b.ply people
  expect 0 --out "walks/a.glb: 2 frames" --out "walks/b.glb: 2 frames" -- transfer --method network --identity people --pose moving.glb --fps 2 --out walks
  printf 'a.obj moving.glb 1.glb\nnone.obj moving.glb 2.glb\nb.ply moving.glb 3.glb\n' > list.txt
  expect 1 --err "1 of 3 sequences failed" --err "list.txt: line 2: none.obj: found no such file" --out "3.glb: 2 frames" -- transfer --method network --pairs list.txt --clip frames --fps 2 --keep-going --report l.jsonl
  [ "$(wc -l < l.jsonl)" -eq 3 ] || fail "report: $(cat l.jsonl)"
  expect 0 --out "3.glb" -- transfer --method network --pairs list.txt --clip frames --fps 2 --shard 3/3
  expect 1 --err "--each: found a sequence in one file" -- transfer --identity a.obj --pose moving.glb --clip frames --out x.glb --each
  # A clip without a mesh is a usual download.
  cat > bare.gltf <<'END'
{"asset":{"version":"2.0"},"nodes":[{}],"scenes":[{"nodes":[0]}],"scene":0,
"buffers":[{"byteLength":32,"uri":"data:application/octet-stream;base64,AAAAAAAAgD8AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA="}],
"bufferViews":[{"buffer":0,"byteLength":8},{"buffer":0,"byteOffset":8,"byteLength":24}],
"accessors":[{"bufferView":0,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[1]},
{"bufferView":1,"componentType":5126,"count":2,"type":"VEC3"}],
"animations":[{"name":"Walk","samplers":[{"input":0,"output":1}],
"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}]}]}
END
  expect 1 --err "bare.gltf: found a skeleton that is not recognised as a person's (confidence 0 %), nor as a four-legged animal's (0 %), expected one of both, or a bone map" \
    -- transfer --identity a.obj --pose bare.gltf --clip Walk --out x.glb
  # GLB files are in metres.
  sed 's/^v \(.*\) \(.*\) \(.*\)$/v \1e2 \2e2 \3e2/' a.obj > cm.obj
  expect 0 --err "cm.obj is taken to be in centimetres, by its size (--unit says another one): cm.glb is in metres" --err "See docs/troubleshooting.md#unit-assumed" -- transfer --method network --identity cm.obj --pose b.ply --out cm.glb
  expect 0 -- info cm.glb
  awk '$1 == "size" { gsub(",", ""); good = $2 < 10 && $3 < 10 && $4 < 10 } END { exit !good }' out.txt || fail "cm.glb is not in metres"
  # OFF needs nothing; FBX, Collada and STL need assimp.
  printf 'OFF\n4 4 0\n0 0 0\n1 0 0\n0 1.5 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n' > a.off
  expect 0 --out "triangles 4" -- info a.off
  expect 0 --out "t.obj in" -- transfer --method network --identity a.off --pose b.ply --out t.obj
  echo "solid nothing" > a.stl
  expect 1 --err "a.stl: " -- info a.stl
  rm -rf t.obj clip c.glb m.glb m.html m.jsonl people walks list.txt l.jsonl [13].glb cm.obj cm.glb a.off a.stl

  printf '# identity pose output\n\na.obj b.ply c.obj # comment\r\na.obj "poses/two words.ply" '"'d e.ply'"'\n' > pairs.txt
  expect 0 --out "2 meshes" -- transfer --method network --pairs pairs.txt
  exists c.obj
  exists "d e.ply"
  rm -f c.obj "d e.ply"
  # Names in a list are relative to it.
  mkdir lists
  printf '../a.obj ../b.ply out.obj\n' > lists/pairs.txt
  expect 0 --out "lists/out.obj in" -- transfer --method network --pairs lists/pairs.txt
  exists lists/out.obj

  # Vertices are paired at random, or as they are given; weights in metres take meshes in centimetres.
  expect 0 -- transfer --method network --identity a.obj --pose a.obj --out random.obj --feature per-vertex
  expect 0 --out "paired as given" -- transfer --method network --identity a.obj --pose a.obj --out given.obj --feature per-vertex --pairing as-given
  different random.obj given.obj
  expect 1 --err "expected 1: only random pairings differ" -- transfer --method network --identity a.obj --pose a.obj --out x.obj --feature per-vertex --pairing as-given --pairings 2
  sed -E 's/^v ([0-9.]+) ([0-9.]+) ([0-9.]+)/v \1e2 \2e2 \3e2/' a.obj > cm.obj
  expect 0 --err "cm.obj is taken to be in centimetres" -- transfer --method network --identity cm.obj --pose b.ply --out x.obj
  expect 0 -- transfer --method network --identity cm.obj --pose cm.obj --out y.obj --unit centimetre
  grep -q "taken to be in" err.txt && fail "a note though the unit is given"
  sed -E 's/^v ([0-9.]+) ([0-9.]+) ([0-9.]+)/v \1e1 \2e1 \3e1/' a.obj > ten.obj
  expect 1 --err "ten.obj: found a mesh 15 units across, expected a person" -- transfer --method network --identity ten.obj --pose b.ply --out z.obj
  local units="expected metre, centimetre, millimetre, inch, foot, or a number of metres above 0"
  expect 1 --err "--unit: found 'furlong', $units" -- transfer --method network --identity a.obj --pose b.ply --out z.obj --unit furlong
  expect 1 --err "--unit: found '0', $units" -- transfer --method network --identity a.obj --pose b.ply --out z.obj --unit 0
  missing z.obj
  expect 0 --err "note: --names changes nothing" -- transfer --method network --identity a.obj --pose b.ply --out x.obj --names smpl
  expect 1 --err "x.fbx: found extension .fbx, expected a folder for the results" -- transfer --method network --identity a.obj --pose frames --out x.fbx
  missing x.fbx
  rm -f random.obj given.obj x.obj y.obj

  # Random weights only where asked for; weights that aren't there are an error that names where they were looked for.
  expect 0 --err "the result is not a pose transfer" -- transfer --method network --identity a.obj --pose b.ply --out x.obj --random-weights
  exists x.obj
  mkdir lost
  cp "$npt" lost/npt
  if NPT_WEIGHTS=$folder/nowhere lost/npt transfer --method network --identity a.obj --pose b.ply --out lost.obj > out.txt 2> err.txt; then
    fail "a transfer without weights"
  fi
  grep -qF "human.safetensors: found no such file in $folder/nowhere, " err.txt || fail "doesn't say where it looked"
  missing lost.obj
  NPT_WEIGHTS=$project/examples/weights lost/npt transfer --method network --identity a.obj --pose b.ply --out x.obj > out.txt 2> err.txt || fail "NPT_WEIGHTS"
  rm -rf lost x.obj

  expect 2 --err "--identity, --pose and --out, or --pairs" -- transfer --method network --identity a.obj
  expect 2 --err "--pairs" -- transfer --method network --pairs pairs.txt --identity a.obj
  expect 2 --err "--threads" -- transfer --method network --identity a.obj --pose b.ply --out c.obj --threads few
  expect 2 --err "--normalise" -- transfer --method network --identity a.obj --pose b.ply --out c.obj --normalise cube
  expect 1 --err "none.obj: found no such file" -- transfer --method network --identity none.obj --pose b.ply --out c.obj
  expect 1 --err "none.safetensors" -- transfer --method network --identity a.obj --pose b.ply --out c.obj --weights none.safetensors
  expect 1 --err "./a.obj: found an output that is also an input" -- transfer --method network --identity a.obj --pose b.ply --out ./a.obj
  expect 1 --err "b.ply: found an output that is also an input" -- transfer --method network --identity a.obj --pose b.ply --out b.ply
  expect 1 --err "nowhere/c.obj" -- transfer --method network --identity a.obj --pose b.ply --out nowhere/c.obj
  expect 1 --err "c.txt: found extension .txt" -- transfer --method network --identity a.obj --pose b.ply --out c.txt
  expect 1 --err "x.jpg" -- transfer --method network --identity a.obj --pose b.ply --out c.obj --render x.jpg
  mkdir taken.obj
  expect 1 --err "taken.obj: found a directory" -- transfer --method network --identity a.obj --pose b.ply --out taken.obj
  # Meshes and weights that can't be used: each names its file, found and expected, and leaves no output.
  printf 'v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n' > nan.obj
  expect 1 --err "nan.obj: line 2: found 'nan', expected a finite number" -- transfer --method network --identity nan.obj --pose b.ply --out bad.obj
  printf 'v 2 2 2\nv 2 2 2\nv 2 2 2\nf 1 2 3\n' > point.obj
  expect 1 --err "point.obj: found all vertices in one point" -- transfer --method network --identity point.obj --pose b.ply --out bad.obj
  expect 1 --err "point.obj: found all vertices in one point" -- transfer --method network --identity a.obj --pose point.obj --out bad.obj
  printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99\n' > index.obj
  expect 1 --err "index.obj: line 4: found" -- transfer --method network --identity a.obj --pose index.obj --out bad.obj
  : > empty.obj
  expect 1 --err "empty.obj: found" -- transfer --method network --identity empty.obj --pose b.ply --out bad.obj
  head -c 100 b.ply > short.ply
  expect 1 --err "short.ply: " -- transfer --method network --identity short.ply --pose b.ply --out bad.obj
  expect 1 --err "b.ply: byte 0: found a header of" -- transfer --method network --identity a.obj --pose b.ply --out bad.obj --weights b.ply
  missing bad.obj
  expect 1 --err "5 vertices" -- transfer --method network --identity a.obj --pose b.ply --out c.obj --resample off --feature per-vertex
  mkdir empty
  expect 1 --err "empty: found a folder without meshes" -- transfer --method network --identity a.obj --pose empty --out new
  missing new
  same a.obj before.obj

  printf 'a.obj b.ply\n' > bad.txt
  expect 1 --err "bad.txt: line 1: found 2 names" -- transfer --method network --pairs bad.txt
  printf '#\na.obj "b.ply c.obj\n' > bad.txt
  expect 1 --err "bad.txt: line 2: found a quotation mark" -- transfer --method network --pairs bad.txt
  printf 'a.obj b.ply c.obj\na.obj b.ply ./c.obj\n' > bad.txt
  expect 1 --err "bad.txt: line 2: found the output of two pairs" -- transfer --method network --pairs bad.txt
  printf 'a.obj b.ply c.obj\nc.obj b.ply d.obj\n' > bad.txt
  expect 1 --err "bad.txt: line 1: found an output that is also an input" -- transfer --method network --pairs bad.txt
  : > bad.txt
  expect 1 --err "bad.txt: found no pairs" -- transfer --method network --pairs bad.txt
  missing c.obj

  # Stop at a bad pair before any work, or go on and still fail at the end.
  printf 'a.obj none.ply c.obj\na.obj broken.ply d.obj\na.obj b.ply e.obj\n' > some.txt
  echo "ply" > broken.ply
  expect 1 --err "some.txt: line 1: none.ply" -- transfer --method network --pairs some.txt
  missing e.obj
  expect 1 --err "some.txt: line 1: none.ply" --err "some.txt: line 2: broken.ply" --err "2 of 3 pairs failed" -- transfer --method network --pairs some.txt --keep-going
  exists e.obj
  missing c.obj
  missing d.obj
}

# Many pairs: whatever the number in flight, the part of the list or what was there before, the files are the same.
# Clips onto joints: the character's own, or those of its body.
test_motion() {
  expect 0 -- generate --count 3 --seed 5 --same-shape --pose natural --out walk
  expect 0 -- generate --seed 5 --pose rest --out rest.ply
  expect 0 -- rig --mesh rest.ply --pose walk --out walker.glb
  expect 0 --out "walk.bvh: 3 frames of walk on its own 40 joints" -- transfer walker.glb walker.glb --clip walk -o walk.bvh
  expect 0 --out "joint count  40" --out "30 frames a second" -- info walk.bvh

  # Onto joints of its own: all else of the file stays, a name that is taken gets a number.
  expect 0 --out "own.glb: 3 frames of walk on its own 40 joints" -- transfer --identity walker.glb --pose walk.bvh --out own.glb
  expect 0 --out "  walk  " --out "  walk_2  " --out "joint count    40" -- info own.glb
  expect 0 --out "by_clip.glb: 3 frames of walk on its own 40 joints" -- transfer walker.glb --clip walk.bvh -o by_clip.glb
  # Of a list it is the clip's name, though a folder is called so.
  echo "walker.glb walker.glb listed.glb" > clips.txt
  expect 0 --out "listed.glb: 3 frames of walk on its own 40 joints" -- transfer --pairs clips.txt --clip walk
  expect 0 -- transfer walker.glb walk.bvh -o named.glb --clip-name Stroll --in-place --no-foot-lock --clearance 0
  expect 0 --out "  Stroll  " --out "in place" -- info named.glb
  # Onto those of its body.
  expect 0 --out "body.glb: 3 frames of walk on a skeleton of 40 joints" -- transfer rest.ply walk.bvh -o body.glb --names mixamo
  expect 1 --err "found one whose results are refined" -- transfer rest.ply walk.bvh -o refined.glb --refine
  missing refined.glb
  expect 0 --out "mixamorig:Hips" --out "  walk  " -- info body.glb
  expect 0 --out "on a skeleton of 40 joints" -- transfer walker.glb walk.bvh -o npt.glb --skeleton npt
  # The moved mesh: shapes, a folder of frames, a pose.
  expect 0 -- transfer walker.glb walk.bvh -o baked.glb --bake
  expect 0 --out "3 morph targets" -- info baked.glb
  expect 0 -- transfer rest.ply walk.bvh -o frames
  exists frames/frame_0002.ply
  expect 0 -- transfer walker.glb walk.bvh -o pose.ply --time 0.05
  expect 0 -- transfer walker.glb walk.bvh -o pose.glb --time 0.05 --apply
  expect 0 --out "  walk  0.067 s" -- info pose.glb
  grep -q "walk_2" out.txt && fail "a pose that was applied is no clip"

  # Pictures, pages, folders and lists.
  expect 0 -- transfer walker.glb walk.bvh -o own.glb --render own.png --view own.html
  exists own.png
  exists own.html
  mkdir people clips && cp walker.glb rest.ply people && cp walk.bvh clips && sed 's/hips/Pelvis/' walk.bvh > clips/other.bvh
  expect 0 --out "walks/rest/walk.glb" --out "walks/walker/other.glb" -- transfer people clips -o walks --report r.jsonl
  [ "$(grep -c '"method":"joints"' r.jsonl)" -eq 4 ] || fail "report: $(cat r.jsonl)"
  printf 'walker.glb walk.bvh 1.glb\nrest.ply walk.bvh 2.glb\n' > list.txt
  expect 0 --out "1.glb: 3 frames" --out "2.glb: 3 frames" -- transfer --pairs list.txt

  # Bone maps, and what is refused.
  "$npt" info --bones walk.bvh > bones.txt
  expect 0 -- transfer walker.glb walk.bvh -o own.glb --source-bone-map bones.txt
  sed 's/leftUpperArm "leftUpperArm" .*/leftUpperArm "nobody"/' bones.txt > wrong.txt
  expect 1 --err "found no joint 'nobody'" -- transfer walker.glb walk.bvh -o x.glb --bone-map wrong.txt
  expect 1 --err "--skeleton own" -- transfer rest.ply walk.bvh -o x.glb --skeleton own
  expect 1 --err "x.obj: found extension .obj, expected .glb or .vrm or .bvh" -- transfer walker.glb walk.bvh -o x.obj
  expect 1 --err "--apply: found a clip" -- transfer walker.glb walk.bvh -o x.glb --apply
  sed 's/^Frames: 3/Frames: 1/' walk.bvh | awk '{ print } /^Frame Time/ { getline; print; exit }' > still.bvh
  expect 1 --err "found a length of 0 s" -- transfer walker.glb still.bvh -o x.glb
  expect 0 -- transfer walker.glb still.bvh -o still.glb --time 0
  printf 'HIERARCHY\nROOT Box\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.04\n0 0 0\n0 0 9\n' > box.bvh
  expect 1 --err "box.bvh: found a skeleton that is not recognised as a person's" -- transfer walker.glb box.bvh -o x.glb
  # An animal's skeleton, with the names of npt's own.
  (
    joint() { printf 'JOINT %s\n{\nOFFSET %s\nCHANNELS 3 Zrotation Xrotation Yrotation\n' "$1" "$2"; }
    tip() { printf 'End Site\n{\nOFFSET %s\n}\n' "$1"; }
    leg() { joint "$1" "$2 -8 4"; joint "$3" "0 -24 $6"; joint "$4" "0 -26 $7"; tip "0 -22 $8"; printf '}\n}\n}\n'; }
    printf 'HIERARCHY\nROOT pelvis\n{\nOFFSET 0 80 -50\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n'
    leg l_hip 12 l_knee l_hock - 12 -20 8
    leg r_hip -12 r_knee r_hock - 12 -20 8
    joint chest "0 2 80"
    leg l_shoulder 12 l_elbow l_wrist - -10 4 4
    leg r_shoulder -12 r_elbow r_wrist - -10 4 4
    joint neck1 "0 5 20"; joint head "0 27 30"; tip "0 0 15"; printf '}\n}\n}\n'
    joint tail1 "0 0 -10"; joint tail2 "0 -12 -15"; tip "0 -20 -5"; printf '}\n}\n}\n'
    printf 'MOTION\nFrames: 3\nFrame Time: 0.04\n'
    awk 'BEGIN { for (f = 0; f < 3; ++f) { line = "0 80 -50"; for (c = 0; c < 54; ++c) line = line " " (c % 7 == 1 ? 9 * f : 0); print line } }'
  ) > dog.bvh
  expect 0 --out "npt, animals" --out "four legged animal  100 % confidence" -- info dog.bvh
  expect 0 --out 'leftHindFoot "l_hock"' --out 'rightForeUpperLeg "r_shoulder"' -- info dog.bvh --bones
  expect 1 --err "dog.bvh: found a four-legged animal's motion on a person (walker.glb), expected a person's motion" \
    --err "npt transfer --across tries it" --err "docs/troubleshooting.md#domains-differ" -- transfer walker.glb dog.bvh -o x.glb
  missing x.glb
  expect 0 --out "3 frames of dog on its own" -- transfer walker.glb dog.bvh -o crawling.glb --across
  expect 0 --out "1 frame of dog on a skeleton of 40 joints" -- transfer rest.ply dog.bvh -o crawling.obj --across --time 0
  expect 1 --err "--format: found bvh for meshes" -- transfer rest.ply rest.ply -o x.ply --format bvh
  expect 1 --err "--method: found network" -- transfer rest.ply walk.bvh -o x.glb --method network
  missing x.glb
}

test_batch() {
  make_meshes
  sed 's/^1 1 1 5$/2 3 4 5/' b.ply > e.ply
  mkdir one four parts
  local with="transfer --method network --feature per-vertex"
  for i in 1 2 3 4 5 6 7 8; do
    local pose=b.ply
    [ $((i % 3)) -eq 0 ] && pose=e.ply
    echo "../a.obj ../$pose $i.obj"
  done > one/list.txt
  cp one/list.txt four/list.txt
  cp one/list.txt parts/list.txt
  expect 0 --out "8 meshes in" -- $with --pairs one/list.txt --in-flight 1 --report one.jsonl
  expect 0 --out "8 meshes in" -- $with --pairs four/list.txt --in-flight 4
  for i in 1 2 3 4 5 6 7 8; do same one/$i.obj four/$i.obj; done
  # Each is as by itself, whether its meshes were kept from another pair or not.
  for i in 3 4 6; do
    expect 0 -- $with a.obj "$([ $((i % 3)) -eq 0 ] && echo e.ply || echo b.ply)" -o alone.obj
    same alone.obj one/$i.obj
  done
  [ ! -s err.txt ] || fail "a run that goes well in a pipe is not quiet"
  # The report: a line a pair, in the list's order.
  [ "$(wc -l < one.jsonl)" -eq 8 ] || fail "$(wc -l < one.jsonl) lines in the report"
  sed -n 3p one.jsonl > out.txt
  for text in '"identity":"one/../a.obj"' '"pose":"one/../e.ply"' '"out":"one/3.obj"' '"status":"done"' '"method":"network"' '"notes":[' '"seconds":' \
    '"measures":{"common_stretch":' '"largest_stretch":' '"stretched_vertex":' '"penetration":'; do
    grep -qF "$text" out.txt || fail "no $text in the report's third line"
  done
  # Parts of the list make up the whole.
  expect 0 --out "2 meshes in" -- $with --pairs parts/list.txt --shard 1/3
  missing parts/3.obj
  expect 0 --out "3 meshes in" -- $with --pairs parts/list.txt --shard 2/3
  expect 0 --out "3 meshes in" -- $with --pairs parts/list.txt --shard 3/3
  for i in 1 2 3 4 5 6 7 8; do same one/$i.obj parts/$i.obj; done
  expect 0 --out "no pairs in this part" -- $with --pairs parts/list.txt --shard 1/100
  expect 1 --err "--shard: found '4/3', expected a part and their number" -- $with --pairs parts/list.txt --shard 4/3
  expect 1 --err "--shard: found '3'" -- $with --pairs parts/list.txt --shard 3
  # What is there is left out.
  rm parts/2.obj parts/7.obj
  echo kept > parts/1.obj
  expect 0 --out "2 meshes in" --out "6 were there" -- $with --pairs parts/list.txt --skip-existing --report parts.jsonl
  [ "$(cat parts/1.obj)" = kept ] || fail "a file that was there is written again"
  for i in 2 7; do same one/$i.obj parts/$i.obj; done
  [ "$(grep -c '"status":"skipped"' parts.jsonl)" -eq 6 ] || fail "skipped pairs are not in the report"
  expect 0 --out "nothing to do: 8 were there" -- $with --pairs parts/list.txt --skip-existing
  # Failures: the others are done, a table at the end, a line each in the report.
  printf 'a.obj none.ply 1.obj\na.obj b.ply 2.obj\na.obj broken.ply long_name.obj\n' > some.txt
  echo ply > broken.ply
  expect 1 --err "failed:" --err "  1.obj          some.txt: line 1: none.ply: found no such file" --err "  long_name.obj  some.txt: line 3: broken.ply" \
    --err "2 of 3 pairs failed" -- $with --pairs some.txt --keep-going --report some.jsonl --in-flight 2
  exists 2.obj
  [ "$(grep -c '"status":"failed".*"error":' some.jsonl)" -eq 2 ] || fail "failures are not in the report"
  rm 2.obj
  # A sequence that goes on has the same frames as one in one go: they depend on each other.
  mkdir frames
  cp b.ply frames/1.ply
  cp e.ply frames/2.ply
  cp b.ply frames/3.ply
  expect 0 --out "3 meshes in" -- $with --identity a.obj --pose frames --out whole
  expect 0 -- $with --identity a.obj --pose frames --out again
  rm again/2.obj
  expect 0 --out "1 mesh in" --out "2 were there" -- $with --identity a.obj --pose frames --out again --skip-existing
  same whole/2.obj again/2.obj
  expect 1 --err "--shard: found one sequence of 3 frames" -- $with --identity a.obj --pose frames --out x --shard 1/2
  # Frames by themselves; several identities.
  expect 0 --out "3 meshes in" -- $with --identity a.obj --pose frames --out each --each
  expect 0 -- $with --identity a.obj --pose e.ply --out single.obj
  same single.obj each/2.obj
  different whole/2.obj each/2.obj
  expect 0 --out "1 mesh in" -- $with --identity a.obj --pose frames --out each_part --each --shard 2/3
  exists each_part/2.obj
  missing each_part/1.obj
  mkdir people
  cp a.obj people/anna.obj
  cp b.ply people/bert.ply
  expect 0 --out "2 meshes in" -- $with --identity people --pose b.ply --out posed
  exists posed/anna.obj
  exists posed/bert.ply
  expect 0 --out "6 meshes in" -- $with --identity people --pose frames --out walks --format ply
  for file in anna/1 anna/3 bert/2; do exists walks/$file.ply; done
  expect 0 --out "3 meshes in" -- $with --identity people --pose frames --out walked --shard 1/2
  exists walked/anna/3.obj
  same walked/anna/2.obj whole/2.obj
  mkdir nobody
  expect 1 --err "nobody: found a folder without meshes" -- $with --identity nobody --pose frames --out x
  missing x
  expect 1 --err "one.jsonl/x" -- $with --identity a.obj --pose b.ply --out y.obj --report one.jsonl/x
  expect 1 --err "a.obj: found an output that is also an input" -- $with --identity a.obj --pose b.ply --out y.obj --report a.obj
  missing y.obj
}

# Pages for a browser, as files; tests/view opens them.
test_view() {
  make_meshes
  expect 0 --out "page.html: 2 panels, 1 frame" -- view a.obj b.ply --out page.html --captions "identity,pose" --colours "blue,-"
  grep -q '^<!doctype html>' page.html || fail "page.html is no page"
  grep -qF '"caption":"identity"' page.html || fail "no caption"
  expect 0 -- view a.obj b.ply --out again.html --captions "identity,pose" --colours "blue,-"
  same page.html again.html
  mkdir frames
  cp b.ply frames/1.ply
  sed 's/^1 1 1 5$/2 3 4 5/' b.ply > frames/2.ply
  expect 0 --out "1 panel, 2 frames" -- view frames --out page.html --fps 10
  grep -qF '"fps":10' page.html || fail "another rate"
  expect 0 --out "1 panel, 1 frame" -- view frames/ --out page.html --every 2 --title "a <walk>"
  grep -qF '<title>a &lt;walk&gt;</title>' page.html || fail "no title"
  expect 0 -- view frames b.ply --truth b.ply --out page.html --scale-bar 100 --up z
  grep -qF '"heat":{"high":100' page.html || fail "no scale of errors"
  expect 0 -- view frames a.obj --truth frames,- --out page.html
  # What can't be shown leaves no page, or the one before.
  cp page.html before.html
  expect 1 --err "a.obj: found 4 vertices, expected 5 as in b.ply" -- view a.obj --truth b.ply --out page.html
  same page.html before.html
  expect 1 --err "--truth: found no mesh with a truth" -- view a.obj --truth - --out x.html
  expect 1 --err "--truth: found 2 entries" -- view a.obj --truth b.ply,b.ply --out x.html
  expect 1 --err "--captions: found 1 entries, expected 2, one for each panel" -- view a.obj b.ply --captions one --out x.html
  expect 1 --err "none.ply: found no such file" -- view none.ply --out x.html
  expect 1 --err "x.png: found extension .png, expected .html or .htm" -- view a.obj --out x.png
  echo text > a.txt
  expect 1 --err "a.txt: found extension .txt, expected .ply or .obj or .glb" -- view a.txt --out x.html
  mkdir empty mixed
  expect 1 --err "empty: found a folder without meshes" -- view empty --out x.html
  cp a.obj b.ply mixed
  expect 1 --err "mixed/b.ply: found 5 vertices, expected 4, as in the sequence's first frame" -- view mixed --out x.html
  expect 1 --err "nowhere/x.html" -- view a.obj --out nowhere/x.html
  expect 2 --err "--truth" -- view a.obj --out x.html --scale-bar 5
  # GLB files: whole, without files beside them, without what the page has no decoder for.
  glb() {
    local length=$(((${#1} + 3) / 4 * 4))
    printf 'glTF\002\000\000\000'
    printf "\\$(printf %03o $(((length + 20) % 256)))\\$(printf %03o $(((length + 20) / 256)))\\000\\000"
    printf "\\$(printf %03o $((length % 256)))\\$(printf %03o $((length / 256)))\\000\\000JSON"
    printf '%-*s' $length "$1"
  }
  glb '{"asset":{"version":"2.0"}}' > good.glb
  expect 0 --out "1 panel" -- view good.glb --out glb.html
  head -c 30 good.glb > short.glb
  expect 1 --err "short.glb: byte 8: found a length of 48, expected 30, the file's" -- view short.glb --out x.html
  echo "no GLB file at all" > bad.glb
  expect 1 --err "bad.glb: byte 0: found no header of a GLB file" -- view bad.glb --out x.html
  glb '{"asset":{"version":"2.0"},"buffers":[{"uri":"../data.bin","byteLength":4}]}' > beside.glb
  expect 1 --err "beside.glb: buffers[0]" --err "'../data.bin'" -- view beside.glb --out x.html
  glb '{"extensionsRequired":["KHR_draco_mesh_compression"]}' > draco.glb
  expect 1 --err "draco.glb: " -- view draco.glb --out x.html
  glb '{"extensionsRequired":["KHR_texture_basisu"]}' > basis.glb
  expect 1 --err "basis.glb: extensionsRequired: found KHR_texture_basisu" -- view basis.glb --out x.html
  glb '{"asset":' > text.glb
  expect 1 --err "text.glb: JSON chunk: found no JSON object" -- view text.glb --out x.html
  missing x.html
  # The commands that transfer.
  expect 0 -- transfer --method network --identity a.obj --pose frames --out results --view transfer.html
  [ "$(grep -oF '"frames":2' transfer.html | wc -l)" -eq 2 ] || fail "pose and result don't move"
  printf 'a.obj b.ply 1.obj\na.obj frames/2.ply 2.obj\n' > list.txt
  expect 0 -- transfer --method network --pairs list.txt --view pairs.html
  [ "$(grep -oF '"caption":"result"' pairs.html | wc -l)" -eq 2 ] || fail "a list is not a group for each pair"
  expect 1 --err "b.ply: found extension .ply, expected .html" -- transfer --method network --identity a.obj --pose b.ply --out x.obj --view b.ply
  expect 0 -- evaluate --pairs 2 --seed 5 --worst 1 --view worst.html
  for text in '"caption":"ground truth"' '"errors":' '"heat":{' 'PMD '; do grep -qF "$text" worst.html || fail "no $text in the worst pair's page"; done
  expect 2 --err "--worst" -- evaluate --pairs 2 --view worst.html
}

test_deform() {
  make_meshes
  sed 's/^v 0 0 1$/v 0 0.4 1.3/' a.obj > posed.obj
  printf '# source target\n0 0\n1 1\n2 2 # up\n3 3\n' > markers.txt
  expect 0 --out "4 markers" --out "c.ply in" -- deform --source a.obj --pose posed.obj --target b.ply --markers markers.txt --out c.ply --registered r.obj --render c.png --view c.html
  for file in c.ply r.obj c.png c.html; do exists $file; done
  expect 0 --out "triangles 6" --out "float heat" -- info c.ply
  expect 0 -- deform --source a.obj --pose posed.obj --target b.ply --markers markers.txt --out d.ply --threads 1
  same c.ply d.ply
  # The source as its own target follows, whatever hangs on it; rest gives rest.
  expect 0 --out "faces are the same" -- deform --source a.obj --pose posed.obj --target a.obj --out c.obj
  diff <(grep -E '^(f|g|vt|usemtl) ' a.obj) <(grep -E '^(f|g|vt|usemtl) ' c.obj) > out.txt || fail "c.obj lost something"
  paste -d' ' <(grep '^v ' posed.obj) <(grep '^v ' c.obj) |
    awk '{ for (i = 2; i <= 4; ++i) { d = $i - $(i + 4); if (d * d > 1e-12) exit 1 } }' || fail "c.obj is not the pose"
  mkdir poses
  cp a.obj poses/rest.obj
  cp posed.obj "poses/two words.obj"
  expect 0 --out "2 meshes in" -- deform --source a.obj --pose poses --target a.obj --out results --format ply
  exists results/rest.ply
  exists "results/two words.ply"
  rm -rf c.* d.ply r.obj results

  expect 2 --err "--source, --pose, --target and --out, or --protocol" -- deform --source a.obj
  expect 2 --err "--control-points" -- deform --source a.obj --pose posed.obj --target b.ply --out c.ply --control-points 7
  expect 2 --err "--markers" -- deform --source a.obj --pose posed.obj --target b.ply --out c.ply --control-points 5 --markers markers.txt
  expect 2 --err "--body" -- deform --source a.obj --pose posed.obj --target b.ply --out c.ply --body x.safetensors
  expect 2 --err "--protocol" -- deform --protocol --source a.obj
  expect 1 --err "--markers: found none, and meshes of different faces" -- deform --source a.obj --pose posed.obj --target b.ply --out c.ply
  expect 1 --err "none.obj: found no such file" -- deform --source none.obj --pose posed.obj --target b.ply --out c.ply
  expect 1 --err "none.obj: found no such file" -- deform --source a.obj --pose none.obj --target b.ply --out c.ply
  expect 1 --err "none.obj: found no such file" -- deform --source a.obj --pose posed.obj --target none.obj --out c.ply
  expect 1 --err "a.obj: found an output that is also an input" -- deform --source a.obj --pose posed.obj --target b.ply --out a.obj
  expect 1 --err "r.txt" -- deform --source a.obj --pose posed.obj --target a.obj --out c.ply --markers markers.txt --registered r.txt
  expect 1 --err "a.obj: found 4 vertices, expected 6890, those of its body" -- deform --source a.obj --pose posed.obj --target a.obj --out c.ply --control-points 5
  printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' > other.obj
  expect 1 --err "other.obj: found 3 vertices, expected 4, as many as a.obj has" -- deform --source a.obj --pose other.obj --target a.obj --out c.ply
  printf 'v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n' > line.obj
  expect 1 --err "target: found faces without an area" -- deform --source a.obj --pose posed.obj --target line.obj --markers markers.txt --out c.ply
  printf '0 0\n9 1\n' > bad.txt
  expect 1 --err "markers: marker 2: found vertex 9 of the source, expected a vertex below 4" -- deform --source a.obj --pose posed.obj --target b.ply --markers bad.txt --out c.ply
  printf '0 0\n1 one\n' > bad.txt
  expect 1 --err "bad.txt: line 2: found 'one'" -- deform --source a.obj --pose posed.obj --target b.ply --markers bad.txt --out c.ply
  expect 1 --err "none.txt: found no such file" -- deform --source a.obj --pose posed.obj --target b.ply --markers none.txt --out c.ply
  missing c.ply
}

# A body that goes half a metre forward and up, and another one, twice as large in its own unit, that takes the clip.
test_clips() {
  expect 0 -- generate --out a.obj --seed 3 --pose rest
  mkdir way
  cp a.obj way/1.obj
  awk '$1 == "v" { printf "v %s %.6f %.6f\n", $2, $3 + 0.3, $4 + 0.5; next } { print }' a.obj > way/2.obj
  awk '$1 == "v" { printf "v %.6f %.6f %.6f\n", 200 * $2, 200 * $3, 200 * $4; next } { print }' a.obj > large.obj
  # How far the first vertex went from frame 0 to 1, in y and z, and whether the lowest point stayed: in thousandths.
  went() {
    awk -v file=0 'FNR == 1 { ++file } $1 == "v" { if (!seen[file]++) { y[file] = $3; z[file] = $4 } if (low == "" || $3 < low) low = $3 }
      END { printf "%d %d %d\n", 1000 * (y[2] - y[1]) / '"$2"' + 0.5, 1000 * (z[2] - z[1]) / '"$2"' + 0.5, 1000 * low / '"$2"' + 0.5 }' "$1"/frame_*.obj
  }
  near() {
    awk -v a="$1" -v b="$2" 'BEGIN { n = split(a, x, " "); split(b, y, " "); for (i = 1; i <= n; ++i) if ((x[i] - y[i])^2 > 225) exit 1 }' ||
      fail "went '$1', expected '$2'"
  }
  expect 0 --out "2 frames of way on a skeleton of 40 joints" -- rig --mesh a.obj --pose way --fps 1 --out clip.glb
  local low
  low=$(awk '$1 == "v" && (low == "" || $3 < low) { low = $3 } END { printf "%d", 1000 * low + 0.5 }' a.obj)
  expect 0 -- transfer --identity a.obj --pose clip.glb --clip way --fps 1 --out along
  near "$(went along 1)" "300 500 $low"
  expect 0 -- transfer --identity a.obj --pose clip.glb --clip way --fps 1 --out still --in-place
  near "$(went still 1)" "0 0 $low"
  expect 0 -- transfer --identity large.obj --unit 0.005 --pose clip.glb --clip way --fps 1 --out far
  near "$(went far 200)" "300 500 $low"
  expect 0 --err "is taken to be in units of" -- transfer --identity large.obj --unit 0.005 --pose clip.glb --clip way --fps 1 --out far.glb
  expect 0 -- info far.glb
  awk '$1 == "size" { gsub(",", ""); good = $3 > 1 && $3 < 2.5 } END { exit !good }' out.txt || fail "far.glb is not in metres"
  # A first frame in which nobody is recognised is followed from one in which somebody is.
  awk 'BEGIN { for (i = 1; i <= 72; ++i) printf "%.4f%s", (i <= 3 ? 0 : 1.5 * sin(5.1 * i)), i % 3 ? " " : "\n" }' > crumpled.txt
  mkdir crumpled
  expect 0 -- generate --out crumpled/1.obj --seed 3 --pose crumpled.txt
  expect 1 --err "not recognised as a person" --err ". See docs/troubleshooting.md#not-recognised" -- transfer --identity a.obj --pose crumpled/1.obj --out x.obj
  cp a.obj crumpled/2.obj
  expect 0 --out "2 meshes" --out "confidence 100 %" -- transfer --identity a.obj --pose crumpled --out followed
  awk 'FNR == 1 { ++file } $1 == "v" { for (k = 2; k <= 4; ++k) { x[file, FNR, k] = $k; sum[file, k] += $k }; rows[FNR] } END {
    for (r in rows) { ++n } for (r in rows) for (k = 2; k <= 4; ++k) { d = x[1, r, k] - sum[1, k] / n - x[2, r, k] + sum[2, k] / n; off += d * d / n }
    exit !(n > 1000 && off < 3e-4) }' followed/1.obj crumpled/1.obj || fail "a crumpled body was not followed from a standing one"
}

# A program that is taken away from its weights names the options that the command has.
test_weights() {
  make_meshes
  cp "$npt" away
  local npt=$PWD/away
  export NPT_WEIGHTS=
  expect 1 --err "human.safetensors: found no such file in" --err "NPT_WEIGHTS names their folder, --weights other ones" \
    --err ". See docs/troubleshooting.md#missing-weights" -- rig --mesh a.obj --out x.glb
  grep -q -e --random-weights err.txt && fail "an option that npt rig doesn't have"
  expect 1 --err "--random-weights draws some" -- transfer --identity a.obj --pose b.ply --out x.obj
  missing x.obj
}

# A rigged character with a clip, as another tool would leave it, trains beside the mannequin.
test_rigs() {
  expect 0 -- generate --out way --count 2 --seed 3 --pose natural
  expect 0 -- rig --mesh way/body_0000.ply --pose way --fps 1 --names mixamo --out own.glb
  local course="--rig own.glb=2 --body mannequin --mix-bodies --bottleneck 64 --steps 60 --stage 0:4x30 --seed 3 --noise 0.01
                --validation-pairs 2 --validate-every 30 --log-every 10"
  expect 0 --out "60 steps" -- train --out whole.safetensors $course --threads 2
  expect 0 --out "mannequin, own" --out "--rig own.glb=2" -- info whole.safetensors
  resumes_after_kill $course
  expect 0 --out "net correspondence, width 256, 3 steps" -- train --net correspondence --rig own.glb --body mannequin --steps 3 --batch 2 --vertices 60 --validation-pairs 1 --out reads.safetensors
  expect 1 --err "--held-out: found 'nap', expected a clip of a rig of the kind" -- train --net correspondence --rig own.glb --held-out nap --body mannequin --steps 3 --batch 2 --vertices 60 --validation-pairs 1 --out none.safetensors
  expect 0 --out "1 mesh" -- generate --body "$project/examples/weights/quadruped.safetensors" --shape zero --pose rest --out beast.obj
  expect 0 --out "2 meshes" -- generate --body "$project/examples/weights/quadruped.safetensors" --same-shape --count 2 --pose natural --out gait
  expect 0 --out "beast.glb" -- rig --mesh beast.obj --pose gait --out beast.glb
  expect 0 --err "npt: note: beast is none of the kind: beast.glb: found 35 joints that are a four-legged animal's, expected a person's" -- train --net correspondence --rig own.glb --rig beast.glb --body mannequin --steps 3 --batch 2 --vertices 60 --validation-pairs 1 --out strangers.safetensors
  expect 0 --out "Inputs: points" -- explain --weights reads.safetensors
  expect 0 --out "points and normals" -- info reads.safetensors
  # Other names for joints: a person's, and one that no person has, which the skeleton's shape tells.
  printf '[own]\nmixamorig:LeftUpLeg left_hip\n' > names.txt
  expect 0 --out "3 steps" -- train --out named.safetensors --rig own.glb --body mannequin --bottleneck 64 --steps 3 --stage 0:2x30 --validation-pairs 1 --joint-names names.txt
  expect 0 --out "--joint-names names.txt" -- info named.safetensors
  printf 'mixamorig:LeftUpLeg wheel\n' > names.txt
  expect 0 --out "3 steps" -- train --out wheel.safetensors --rig own.glb --body mannequin --bottleneck 64 --steps 3 --stage 0:2x30 --validation-pairs 1 --joint-names names.txt
  printf '[other]\na b\n' > names.txt
  expect 1 --err "names.txt: line 2: found [other], expected one of the rigs: own" -- evaluate --rig own.glb --joint-names names.txt
  expect 1 --err "--held-out: found neither" -- train --steps 3 --out x.safetensors --held-out way
  expect 1 --err "--clip-poses: found no --rig" -- train --steps 3 --out x.safetensors --clip-poses 0.5
  expect 1 --err "a weight of 0" -- train --steps 3 --out x.safetensors --rig own.glb=0
  expect 1 --err "found a file without a skeleton" -- train --steps 3 --out x.safetensors --rig way/body_0000.ply
  expect 0 -- transfer --identity way/body_0000.ply --pose way/body_0000.ply --out still.glb --method network
  expect 1 --err "still.glb: found no skin, expected a rigged character" -- train --steps 3 --out x.safetensors --rig still.glb
}

test_skeleton() {
  make_meshes
  expect 0 -- generate --out bodies --count 3 --seed 7
  local id=bodies/body_0000.ply pose=bodies/body_0001.ply
  # The first pose alone, and within a folder: the same file.
  expect 0 --out "c.ply in" --out "bodies fitted to 0." -- skeleton --identity $id --pose $pose --out c.ply --fitted f.obj --render c.png --view c.html
  for file in c.ply f.obj c.png c.html; do exists $file; done
  expect 0 --out "vertices       6890" -- info c.ply
  mkdir poses
  cp $pose bodies/body_0002.ply poses
  expect 0 --out "2 meshes in" -- skeleton --identity $id --pose poses --out results --threads 1
  same c.ply results/body_0001.ply
  different c.ply results/body_0002.ply
  rm -rf c.* f.obj

  expect 2 --err "--identity, --pose and --out, or --protocol" -- skeleton --identity $id
  expect 2 --err "--protocol" -- skeleton --protocol --identity $id
  expect 2 --err "--json" -- skeleton --identity $id --pose $pose --out c.ply --json
  expect 1 --err "none.ply: found no such file" -- skeleton --identity none.ply --pose $pose --out c.ply
  expect 1 --err "none.ply: found no such file" -- skeleton --identity $id --pose none.ply --out c.ply
  expect 1 --err "none.safetensors" -- skeleton --identity $id --pose $pose --out c.ply --body none.safetensors
  expect 1 --err "$id: found an output that is also an input" -- skeleton --identity $id --pose $pose --out $id
  expect 1 --err "f.txt" -- skeleton --identity $id --pose $pose --out c.ply --fitted f.txt
  printf 'v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n' > line.obj
  expect 1 --err "line.obj: found 1 triangles, none of which has an area, expected a surface" -- skeleton --identity $id --pose line.obj --out c.ply
  printf 'v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n' > large.obj
  expect 1 --err "large.obj: found a surface of 5000" -- skeleton --identity large.obj --pose $pose --out c.ply
  # What is no body gets a result all the same, and a note.
  expect 0 --err "the pose may be wrong" -- skeleton --identity a.obj --pose $pose --out c.obj
  exists c.obj
  missing c.ply
}

test_evaluate() {
  make_meshes
  # A transfer's own result as the truth: evaluation takes the way of transfer, whatever the vertex counts, to the last bit
  # that PLY keeps.
  expect 0 -- transfer --method network --identity a.obj --pose b.ply --out t.ply --seed 3 --feature per-vertex
  mkdir lists
  printf '# identity pose truth\n../a.obj ../b.ply ../t.ply\n' > lists/list.txt
  expect 0 --out '"pmd":0.0,' --out '"pairs":1' -- evaluate --method network --list lists/list.txt --feature per-vertex --seed 3 --json
  expect 0 --out "PMD x 1e-4" --out "list.txt" --out "a.obj as b.ply" -- evaluate --method network --list lists/list.txt --feature per-vertex --seed 3 --worst 5
  expect 0 --out '"pmd":' -- evaluate --method network --list lists/list.txt --feature per-vertex --seed 4 --json
  grep -q '"pmd":0.0,' out.txt && fail "another seed of random weights gives the same result"

  # The same for any threads; noise and seeds matter.
  pmd_of() { grep -o '"pmd":[^,]*' out.txt; }
  expect 0 --out "fresh pairs of mannequin, seed 5" -- evaluate --method network --pairs 2 --seed 5 --threads 1 --json
  local first
  first=$(pmd_of)
  expect 0 -- evaluate --method network --pairs 2 --seed 5 --threads 2 --json
  [ "$(pmd_of)" = "$first" ] || fail "threads change the result"
  # Written and read again they are the same pairs.
  expect 0 -- evaluate --method network --pairs 2 --seed 5 --write pairs --json
  expect 0 -- evaluate --method network --list pairs/list.txt --seed 5 --json
  [ "$(pmd_of)" = "$first" ] || fail "pairs that were written have other results"
  expect 2 --err "--write" -- evaluate --sequences 1 --write pairs

  # Results of another method, in any format: those of npt transfer have the errors that evaluation finds itself.
  mkdir pairs/own
  printf '%04d_identity.ply %04d_pose.ply own/%04d_result.%s\n' 0 0 0 ply 1 1 1 obj > pairs/jobs.txt
  expect 0 -- transfer --method network --pairs pairs/jobs.txt --seed 5
  expect 0 --out '"network":"results in pairs/own"' -- evaluate --list pairs/list.txt --results pairs/own --json
  [ "$(pmd_of)" = "$first" ] || fail "results of npt transfer have other errors than evaluation finds"
  expect 0 --out "results in pairs/own on fresh pairs of mannequin, seed 5" --out "worst of fresh pairs" \
    -- evaluate --pairs 2 --seed 5 --results pairs/own --worst 1 --view own.html --threads 2
  [ ! -s err.txt ] || fail "a note about good results"
  exists own.html
  # Beside the pairs, too.
  cp pairs/own/* pairs
  expect 0 --out "results in pairs on pairs/list.txt" -- evaluate --list pairs/list.txt --results pairs
  local both="expected 0000_result.ply to 0001_result.ply, a mesh for each of the 2 pairs"
  expect 1 --err "none: found no such folder, $both" -- evaluate --pairs 2 --results none
  mv pairs/own/0001_result.obj second.obj
  expect 1 --err "own: found no 0001_result, $both" -- evaluate --pairs 2 --seed 5 --results pairs/own
  mkdir empty
  expect 1 --err "empty: found no 0000_result (2 results are missing), $both" -- evaluate --pairs 2 --seed 5 --results empty
  cp a.obj pairs/own/0001_result.obj
  expect 1 --err "0001_result.obj: found 4 vertices, expected " --err "the identity" -- evaluate --pairs 2 --seed 5 --results pairs/own
  cp second.obj pairs/own/0001_result.obj
  cp second.obj pairs/own/0002_result.obj
  expect 1 --err "0002_result.obj: found a mesh of no pair, $both" -- evaluate --pairs 2 --seed 5 --results pairs/own
  mv pairs/own/0002_result.obj pairs/own/1_result.obj
  expect 1 --err "1_result.obj: found a mesh of no pair" -- evaluate --pairs 2 --seed 5 --results pairs/own
  mv pairs/own/1_result.obj pairs/own/0000_result.obj
  expect 1 --err "found a second result beside 0000_result.obj, expected one for each pair" -- evaluate --pairs 2 --seed 5 --results pairs/own
  for option in "--method network" "--sequences 1" "--write x" --mirror "--weights x.safetensors"; do
    expect 2 --err "${option%% *}" --err "--results" -- evaluate --results pairs/own $option
  done
  # Vertices in another order, and another unit, are told.
  printf 'b.ply a.obj b.ply\n' > one.txt
  mkdir one
  awk 'NR == 11 { first = $0; next } NR == 12 { print; print first; next }
       NR > 15 { for (i = 2; i <= 4; ++i) if ($i < 2) $i = 1 - $i } { print }' b.ply > one/0000_result.ply
  expect 0 --err "note: 1 result, first one/0000_result.ply, with other edges" -- evaluate --list one.txt --results one
  awk 'NR > 10 && NR < 16 { $1 *= 100; $2 *= 100; $3 *= 100 } { print }' b.ply > one/0000_result.ply
  expect 0 --err "note: 1 result, first one/0000_result.ply, of quite another size" -- evaluate --list one.txt --results one
  expect 0 -- evaluate --method network --pairs 2 --seed 5 --noise 0.01 --json
  [ "$(pmd_of)" != "$first" ] || fail "noise changes nothing"
  [ "$(wc -l < out.txt)" -eq 1 ] || fail "JSON of more than one line"

  # Natural poses: another set of pairs, the same for the same seed; characters have the same poses.
  expect 0 --out "fresh pairs in natural poses of mannequin, seed 4" --out '"pmd_median":' --out '"pmd_worst":' -- evaluate --pairs 2 --seed 4 --poses natural --json
  local natural
  natural=$(pmd_of)
  [ "$natural" != "$first" ] || fail "natural poses are the paper's"
  expect 0 -- evaluate --pairs 2 --seed 4 --poses natural --json --threads 1
  [ "$(pmd_of)" = "$natural" ] || fail "natural poses differ for another number of threads"
  expect 0 --out "natural poses and random proportions of mannequin" --out "median" --out "worst" -- evaluate --pairs 1 --poses natural --proportions
  expect 2 --err "--proportions" -- evaluate --protocol --proportions
  expect 0 --out "natural poses of the dressed mannequin" -- evaluate --pairs 1 --poses natural --clothes
  expect 0 --out "random proportions of the dressed mannequin" -- evaluate --pairs 1 --poses natural --clothes --proportions
  expect 2 --err "--clothes" -- evaluate --protocol --clothes
  expect 2 --err "--poses" -- evaluate --pairs 1 --poses odd

  mkdir -p family/cat family/dog
  cp a.obj family/cat/sit.obj
  cp a.obj family/cat/run.obj
  cp b.ply family/dog/Sit.ply
  expect 0 --out "all labels" -- evaluate --method network --family family --feature pooled
  expect 0 --out "held-out labels" --out "cat run as dog Sit" -- evaluate --method network --family family --feature pooled --held-out sit --worst 9
  expect 1 --err "'fly'" -- evaluate --family family --held-out fly
  expect 1 --err "'fly'" -- evaluate --family family --held-out sit,fly
  expect 1 --err "'fly'" -- train --family family --out x.safetensors --steps 5 --held-out sit,fly
  cp b.ply family/cat/walk.ply
  expect 1 --err "walk.ply: found 5 vertices, expected 4" -- evaluate --family family

  # What makes results better, and sequences.
  expect 0 -- evaluate --method network --pairs 2 --seed 5 --json
  local plain
  plain=$(pmd_of)
  if "$npt" evaluate --method network --pairs 2 --seed 5 --json --refine > refined.txt 2> err.txt; then
    grep -qF "$plain" refined.txt && fail "--refine changes nothing"
    grep -qF "refined within 0.04" refined.txt || fail "the refinement isn't named"
    expect 0 --out "refined within 0.1" -- evaluate --pairs 1 --refine --refine-radius 0.1
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\n' > points.obj
    expect 1 --err "found no faces, expected a mesh with a surface" -- transfer --method network --identity points.obj --pose b.ply --out x.obj --refine
    missing x.obj
    expect 0 -- transfer --method network --identity a.obj --pose b.ply --out x.obj --refine --render x.png
    exists x.obj
  else
    grep -qF "built without Eigen" err.txt || fail "--refine: neither a result nor a reason"
  fi
  expect 0 --out "mirrored" -- evaluate --method network --pairs 2 --seed 5 --mirror
  # Options that change nothing are told, and poses that no pair would have are refused.
  expect 0 --err "note: --pairings, --mirror: only results of the network change" -- evaluate --pairs 1 --pairings 2 --mirror
  expect 0 --err "note: --quality changes nothing" -- evaluate --method network --pairs 1 --quality best
  expect 2 --err "--poses" --err "--pairs or --sequences" -- evaluate --poses natural
  expect 2 --err "--shapes" -- evaluate --list lists/list.txt --shapes uniform
  expect 0 --err "--pairings changes nothing" -- evaluate --method network --pairs 1 --pairings 3 --feature pooled
  expect 0 --out "3 pairings" -- evaluate --method network --list lists/list.txt --pairings 3 --feature per-vertex
  expect 0 --out '"jitter_mm":' --out '"true_jitter_mm":' -- evaluate --method network --sequences 1 --frames 3 --json
  expect 0 --out "jitter mm" -- evaluate --sequences 1 --frames 3 --fresh-choices --invariant --feature per-vertex
  expect 0 --out "1 sequences in natural poses of mannequin" -- evaluate --sequences 1 --frames 3 --poses natural
  expect 2 --err "--frames" -- evaluate --frames 5
  expect 2 --err "--frames" -- evaluate --sequences 1 --frames 2
  expect 2 --err "--refine-radius" -- evaluate --pairs 1 --refine-radius 0.1
  expect 2 --err "--refine-radius" -- evaluate --pairs 1 --refine --refine-radius 0
  expect 2 --err "--pairings" -- transfer --identity a.obj --pose b.ply --out x.obj --pairings 0

  expect 2 --err "--list" -- evaluate --list lists/list.txt --protocol
  expect 2 --err "--held-out" -- evaluate --held-out walk
  expect 2 --err "--pairs" -- evaluate --pairs 0
  expect 1 --err "none.txt: found no such file" -- evaluate --list none.txt
  expect 1 --err "none.safetensors" -- evaluate --body none.safetensors
  expect 1 --err "noise: found -1" -- evaluate --pairs 1 --noise -1
  printf 'a.obj b.ply\n' > bad.txt
  expect 1 --err "bad.txt: line 1: found 2 names" -- evaluate --list bad.txt
  printf 'a.obj b.ply none.ply\n' > bad.txt
  expect 1 --err "bad.txt: line 1: found no file 'none.ply'" -- evaluate --list bad.txt
  printf 'a.obj a.obj b.ply\n' > bad.txt
  expect 1 --err "b.ply: found 5 vertices, expected 4" -- evaluate --list bad.txt
}

test_train() {
  local course="--bottleneck 64 --steps 60 --stage 0:6x20 --stage 0.5:3x50 --rate 1e-3 --average 0.9 --clip 1 --seed 3
                --validation-pairs 1 --validate-every 10 --log-every 5"
  expect 0 --out "step 10, " --out "17 %: PMD" --out "whole.safetensors: bottleneck 64, conv_relu, pooled, 60 steps" \
    -- train --out whole.safetensors $course --threads 2
  for file in whole.safetensors whole.checkpoint.safetensors whole.log.csv whole.log.png; do exists $file; done
  [ "$(wc -l < whole.log.csv)" -eq 13 ] || fail "whole.log.csv has no row every 5 steps"
  expect 0 --out "normalisation:  centre" --out "npt train --bottleneck 64 --steps 60" --out "pmd:" --out "mannequin" \
    -- info whole.safetensors
  expect 0 -- generate --out a.ply --seed 1
  expect 0 --out "b.ply in" -- transfer --identity a.ply --pose a.ply --out b.ply --weights whole.safetensors
  resumes_after_kill $course
  diff <(cut -d, -f1,3,4,13 whole.log.csv) <(cut -d, -f1,3,4,13 killed.log.csv) > out.txt ||
    fail "the resumed training's log has other steps, rates or validations"
  expect 2 --err "--threads" -- train --out x.safetensors --threads many
  # Ctrl-C: the step is finished, everything is written, and the training can go on.
  "$npt" train --out stopped.safetensors --bottleneck 64 --minutes 5 --batch 2 --vertices 20 > out.txt 2> err.txt &
  local pid=$!
  while kill -0 $pid 2> /dev/null && [ ! -s stopped.log.csv ]; do sleep 0.01; done
  sleep 0.3
  kill -INT $pid
  wait $pid
  [ $? -eq 130 ] || fail "interrupted: exit status $?, expected 130"
  grep -qF "goes on from here" out.txt || fail "no word about going on"
  for file in stopped.safetensors stopped.checkpoint.safetensors stopped.log.png; do exists $file; done
  [ -z "$(find . -name '*.part-*')" ] || fail "a temporary file stays"
  expect 0 --out "going on at step" -- train --out stopped.safetensors --resume --minutes 0.001

  expect 2 --err "--out" -- train --minutes 1
  expect 2 --err "--minutes or --steps" -- train --out x.safetensors
  expect 2 --err "--steps" -- train --out x.safetensors --steps 5 --minutes 1
  expect 2 --err "--stage" -- train --out x.safetensors --steps 5 --stage 0:4x5 --batch 3
  expect 1 --err "--stage: found '0.5'" -- train --out x.safetensors --steps 5 --stage 0.5
  expect 1 --err "stages: found none that begins at 0" -- train --out x.safetensors --steps 5 --stage 0.5:4x5
  expect 1 --err "--vertices: found 'few'" -- train --out x.safetensors --steps 5 --vertices few
  expect 1 --err "vertices of a sample: found 9999" -- train --out x.safetensors --steps 5 --vertices 9999
  expect 1 --err "--edge-loss: found relative with random vertices only" -- train --out x.safetensors --steps 5 --edge-loss relative
  expect 1 --err "x.txt: found extension .txt" -- train --out x.txt --steps 5
  expect 1 --err "nowhere/x.safetensors" -- train --out nowhere/x.safetensors --steps 5
  expect 1 --err "none.safetensors: found no such file" -- train --out x.safetensors --steps 5 --body none.safetensors
  expect 1 --err "a weight of -1" -- train --out x.safetensors --steps 5 --body mannequin=-1
  expect 1 --err "nofamily" -- train --out x.safetensors --steps 5 --family nofamily
  expect 1 --err "x.checkpoint.safetensors: found no such file" -- train --out x.safetensors --resume
  expect 1 --err "whole.checkpoint.safetensors: found the checkpoint of an earlier training" -- train --out whole.safetensors --steps 5
  expect 1 --err "--rate: found '2', expected '1e-3', with which the training in whole.checkpoint.safetensors began" \
    -- train --out whole.safetensors --resume --rate 2
  cp whole.safetensors broken.checkpoint.safetensors
  expect 1 --err "broken.checkpoint.safetensors: metadata kind: found nothing" -- train --out broken.safetensors --resume
  expect 1 --err "metadata bottleneck" -- train --out x.safetensors --steps 5 --start whole.safetensors --bottleneck 128
  expect 1 --err "training: step " --err "finite numbers" -- train --out x.safetensors --steps 50 --rate 1e30 --warm-up 0 --batch 1 --vertices 9 --bottleneck 64
  missing x.safetensors

  # Other data, order and losses; whole meshes have edges.
  expect 0 -- train --out edge.safetensors --bottleneck 64 --order relu_conv --feature per-vertex --steps 1 --batch 1 --vertices all \
    --edge-loss relative --normalisation sphere --validation-pairs 0
  expect 0 --out "order:  relu_conv" --out "normalisation:  sphere" -- info edge.safetensors
  expect 0 -- train --out on.safetensors --start whole.safetensors --steps 1 --bottleneck 64 --batch 1 --vertices 20 --schedule constant \
    --rate 1e-30 --validation-pairs 0 --yaw 30 --noise 0.01 --scale-range 0.9,1.1 --protocol
  expect 0 --out "2 steps" -- train --out natural.safetensors --bottleneck 64 --steps 2 --batch 2 --vertices 60 --natural-poses 0.5 \
    --wide-poses 0.3 --validation-pairs 0
  expect 1 --err "wide_poses and natural_poses: found 1.2" -- train --out x.safetensors --steps 2 --natural-poses 0.6 --wide-poses 0.6
  expect 2 --err "--natural-poses" -- train --out x.safetensors --steps 2 --natural-poses 0.6 --protocol
  mkdir -p family/one family/two
  for label in stand jump; do
    "$npt" generate --out "family/one/$label.ply" --shape 1 --seed ${#label} > out.txt
    "$npt" generate --out "family/two/$label.ply" --shape -1 --seed ${#label} > out.txt
  done
  expect 0 --out "2 steps" -- train --out animals.safetensors --family family --held-out jump --bottleneck 64 --steps 2 --batch 2 \
    --vertices 30 --validation-pairs 1
  expect 0 --out "trained_on:  one, two" --out "normalisation:  sphere" -- info animals.safetensors
}

test_reproduce() {
  expect 0 --out '"pairs":1' -- deform --protocol --first 1 --control-points 5 --json
  # The shipped weights, so that only one network has to be trained, and since meshes torn to pieces take seconds each to draw.
  cp "$project/examples/weights/human.safetensors" full.safetensors
  local common="--out run --bottleneck 64 --first 1 --budget 0.01 --panel-height 40"
  expect 0 --out "npt skeleton --protocol --json --first 1" --out "| compact pose feature | " --out "| full model | " \
    --out "figure 8, two vertex orders: drawn" --err "figure 14 is left out: it needs a family" \
    -- reproduce --table 7 --figure 8,14 $common --weights full=full.safetensors --threads 2
  for file in tables.md tables.json results/{skeleton,compact,full}.json weights/compact.safetensors figures/figure_08.{png,txt}; do
    exists "run/$file"
  done
  missing run/figures/figure_14.png
  missing run/weights/full.safetensors
  # Again: nothing is trained, measured or drawn.
  cp run/tables.md before.md
  expect 0 --out "figure 8, two vertex orders: there" -- reproduce --table 7 --figure 8 $common --weights full=full.safetensors
  ! grep -qE "^npt |drawn" out.txt || fail "something was made twice"
  same run/tables.md before.md
  # The command beside a picture draws it.
  mv run/figures/figure_08.png before.png
  (npt() { "$npt" "$@"; }; eval "$(cat run/figures/figure_08.txt)") > out.txt 2> err.txt || fail "the command beside figure 8 fails"
  same run/figures/figure_08.png before.png
  # Other weights are measured again.
  cp run/weights/compact.safetensors full.safetensors
  expect 0 --out "npt evaluate" -- reproduce --table 7 $common --weights full=full.safetensors
  different run/tables.md before.md

  expect 2 --err "--out" -- reproduce --table 1
  expect 2 --err "--budget" -- reproduce --table 1 --out x --budget 0
  expect 2 --err "--first" -- reproduce --table 1 --out x --first 0
  expect 1 --err "--table: found 3, expected 1, 2 or 7" -- reproduce --table 3 --out x
  expect 1 --err "--figure: found 21, expected 6 to 20" -- reproduce --figure 6..21 --out x
  expect 1 --err "--figure: found 'six'" -- reproduce --figure six --out x
  expect 1 --err "--weights: found 'full'" -- reproduce --table 1 --out x --weights full
  expect 1 --err "system: found 'best'" -- reproduce --table 1 --out x --weights best=full.safetensors
  expect 1 --err "none.safetensors: found no such file" -- reproduce --table 1 --out x --weights full=none.safetensors
  expect 1 --err "none.safetensors: found no such file" -- reproduce --table 1 --out x --body none.safetensors
  missing x
  expect 1 --err "none.ply: found no such file" -- reproduce --figure 10 --out y --foreign-identities none.ply
  expect 1 --err "nofamily" -- reproduce --figure 14 --out y --family nofamily
  expect 1 --err "run/plan.json: found" --err "or another --out" -- reproduce --table 7 --out run --bottleneck 128
  # A figure that can't be drawn is named.
  printf 'no weights' > broken.safetensors
  expect 1 --err "figure 8: npt transfer" --err "1 of 1 figures could not be drawn" \
    -- reproduce --figure 8 --out run --bottleneck 64 --first 1 --weights full=broken.safetensors
}

test_bench() {
  expect 0 --out '"share": ' --out '"gradient_error": ' -- bench train --json --bottleneck 64 --vertices 50 --batch 2 --repeats 1
  expect 0 --out "GFLOP/s" --out "backward" -- bench train --bottleneck 64 --vertices 50 --batch 2 --repeats 1 --feature pooled
  expect 0 --out '"share": ' -- bench forward --json --bottleneck 64 --vertices 50 --repeats 1
  expect 0 --out '"peak_memory_mb":' --out '"vertices":27554' --out '"a further frame"' -- bench transfer --json --random-weights --repeats 1 --frames 1 --subdivisions 1
  expect 0 --out "first result" --out "a further frame" --out "PMD x 1e-4" -- bench transfer --random-weights --repeats 1 --frames 2 --large-repeats 0 --seed 3
  expect 2 --err "--subdivisions" -- bench transfer --subdivisions 9
  expect 1 --err "--vertices: found 99999" -- bench train --vertices 99999
  expect 2 --err "--bottleneck" -- bench train --bottleneck 3
  expect 2 --err "'-1' is not a whole number" -- bench forward --seed=-1
}

# Two processes on this machine train as one does, up to the order of sums.
test_mpi() {
  local course="--bottleneck 64 --steps 20 --stage 0:6x20 --stage 0.5:4x50 --rate 1e-3 --log-every 1 --validation-pairs 1 --threads 1"
  local together="timeout 120 mpirun -n 2 --allow-run-as-root --oversubscribe"
  expect 0 -- train --out one.safetensors $course
  $together "$npt" train --out two.safetensors $course > out.txt 2> err.txt || fail "two processes: exit status $?"
  for file in two.safetensors two.checkpoint.safetensors two.log.csv two.log.png; do exists $file; done
  paste -d, <(cut -d, -f1,5 one.log.csv) <(cut -d, -f1,5 two.log.csv) |
    awk -F, 'NR > 1 { d = $2 - $4; if ($1 != $3 || d * d > 1e-6 * $2 * $2) exit 1 } END { if (NR != 21) exit 1 }' ||
    fail "two processes have other losses than one"
  # What stops one stops all, and says why.
  $together "$npt" train --out x.safetensors --steps 5 --batch 3 > out.txt 2> err.txt && fail "a batch of 3 for two processes"
  grep -qF "batch: found 3, expected a multiple of the number of processes" err.txt || fail "no word about the batch"
  missing x.safetensors

  # A list of pairs is divided, with one report.
  make_meshes
  for i in 1 2 3 4 5; do echo "a.obj b.ply $i.obj"; done > list.txt
  expect 0 -- transfer --method network --identity a.obj --pose b.ply --out alone.obj
  $together "$npt" transfer --method network --pairs list.txt --report report.jsonl > out.txt 2> err.txt || fail "two processes: exit status $?"
  grep -qF "5 meshes in" out.txt || fail "no sum of both"
  for i in 1 2 3 4 5; do same $i.obj alone.obj; done
  [ "$(grep -c '"status":"done"' report.jsonl)" -eq 5 ] || fail "not all in the report"
  missing report.jsonl.process-1
  $together "$npt" transfer --method network --pairs list.txt --skip-existing > out.txt 2> err.txt || fail "nothing to do: exit status $?"
  grep -qF "5 were there" out.txt || fail "both should have found theirs"
}

"test_$area"
if [ "$failures" -ne 0 ]; then
  echo "$failures failures"
  exit 1
fi
echo "$area: all as expected"
