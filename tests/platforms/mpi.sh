#!/usr/bin/env bash
# Training by two processes under mpirun: ends within rounding of one process's, resumes, fails cleanly when a process dies.
# usage: tests/platforms/mpi.sh [PROGRAM]     PROGRAM built with NPT_WITH_MPI; without: preset mpi is built
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

program="${1:-}"
if [ -z "$program" ]; then
  cmake --preset mpi > /dev/null
  cmake --build --preset mpi > /dev/null
  program="$PWD/build/mpi/bin/npt"
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1  # as in containers
two=(mpirun -n 2 --oversubscribe)
# The arguments of a training, into `training`. Its rates are low: at the usual ones each step makes a difference of rounding ten
# times as large.
arguments_of() {
  training=("$program" train --bottleneck 64 --batch 4 --vertices 96 --steps "$2" --seed 3 --threads 1 --rate 1e-4 --matrix-rate 1e-3 --log-every 1 --checkpoint-every 2
    --validation-pairs 0 --out "$folder/$1.safetensors")
}
values() { od -An -v -w4 -tf4 -j "$((8 + $(od -An -tu8 -N8 "$folder/$1.safetensors")))" "$folder/$1.safetensors"; }
# The largest difference of two files' weights, as a share of the largest weight.
difference() {
  paste <(values "$1") <(values "$2") | awk '{ d = $1 - $2; if (d < 0) d = -d; if (d > most) most = d; w = $1 < 0 ? -$1 : $1; if (w > top) top = w }
    END { print most / top }'
}
below() { awk -v x="$1" -v bound="$2" 'BEGIN { exit !(x < bound) }' || { echo "mpi.sh: $3: $1, expected less than $2" >&2; exit 1; }; }

arguments_of one 4
"${training[@]}" > "$folder/one.txt" 2>&1
arguments_of two 4
"${two[@]}" "${training[@]}" > "$folder/two.txt" 2>&1
share=$(difference one two)
echo "four steps by two processes and by one: weights differ by $share of the largest"
below "$share" 1e-4 "weights of two processes"

# One of the two is killed in the middle: mpirun ends with a failure, nobody is left, the checkpoint is whole.
arguments_of killed 100000
"${two[@]}" "${training[@]}" > "$folder/killed.txt" 2>&1 &
launcher=$!
for ((i = 0; i < 600; ++i)); do
  [ "$(wc -l 2> /dev/null < "$folder/killed.log.csv" || echo 0)" -lt 8 ] || break
  kill -0 "$launcher" 2> /dev/null || break
  sleep 0.1
done
victim=$(pgrep -P "$launcher" -f "bin/npt train" | tail -1)
[ -n "$victim" ] || { cat "$folder/killed.txt" >&2; echo "mpi.sh: no process to kill" >&2; exit 1; }
kill -9 "$victim"
status=0
wait "$launcher" || status=$?
[ "$status" -ne 0 ] || { echo "mpi.sh: mpirun ended with status 0 although a process was killed" >&2; exit 1; }
[ -z "$(pgrep -P "$launcher" || true)" ] || { echo "mpi.sh: a process is left" >&2; exit 1; }
[ ! -e "$folder/killed.safetensors" ] || { echo "mpi.sh: weights of a training that didn't end" >&2; exit 1; }
"$program" info "$folder/killed.checkpoint.safetensors" > /dev/null
echo "a killed process: mpirun ended with status $status, the checkpoint is whole"

# Broken off and gone on with, by two: as without the break.
arguments_of whole 40
"${two[@]}" "${training[@]}" > "$folder/whole.txt" 2>&1
arguments_of broken 40
"${two[@]}" "${training[@]}" > "$folder/broken.txt" 2>&1 &
launcher=$!
for ((i = 0; i < 600; ++i)); do
  [ "$(wc -l 2> /dev/null < "$folder/broken.log.csv" || echo 0)" -lt 8 ] || break
  sleep 0.05
done
kill -9 "$(pgrep -P "$launcher" -f "bin/npt train" | tail -1)" || { echo "mpi.sh: the training was over too early" >&2; exit 1; }
wait "$launcher" || true
"${two[@]}" "$program" train --resume --threads 1 --out "$folder/broken.safetensors" > "$folder/resumed.txt" 2>&1 || { cat "$folder/resumed.txt" >&2; exit 1; }
share=$(difference whole broken)
echo "a training that was broken off and resumed: weights differ by $share of the largest"
below "$share" 1e-6 "resumed weights"
