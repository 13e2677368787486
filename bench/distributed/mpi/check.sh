#!/bin/sh
# bench/distributed/mpi/check.sh LLMT LLMT_MPI [KILLS]: fits of a table by 1, 2, 4, 7, 9 processes have the bytes of llmt fit; so have
# fits of which a process was killed at one of KILLS moments, gone on with from their checkpoints. A job whose process was
# killed leaves no model, and one with a wrong table or a process that waits for ever ends.
set -eu
llmt=$1
llmt_mpi=$2
kills=${3:-2}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
say() { printf '%s\n' "$*"; }
fail() { say "FAILED: $*"; exit 1; }
mpi() {
  processes=$1; shift
  # OMPI_*: more processes than processors, and root in containers.
  OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 timeout 300 mpirun --oversubscribe -n "$processes" \
    "$llmt_mpi" d.arrow -t y --memory 16M --validity crisp --max-leaves 4 --cv 2 --threads 1 "$@"
}

awk 'BEGIN {
  srand(1); print "a,b,y"
  for (i = 0; i < 400000; ++i) { a = rand(); b = rand(); printf "%.6f,%.6f,%.6f\n", a, b, sin(6 * a) + b * b + 0.1 * rand() }
}' >d.csv
"$llmt" table d.csv -o d.arrow
"$llmt" fit d.arrow -t y --memory 16M --validity crisp --max-leaves 4 --cv 2 --threads 1 -o one.json
for processes in 1 2 4 7 9; do  # there are seven blocks: some of nine processes have no rows
  mpi $processes -o "$processes.json"
  cmp one.json "$processes.json" || fail "$processes processes give other bytes"
done

killed=0
for seed in $(seq 1 "$kills"); do
  rm -f state killed.json
  mpi 3 --checkpoint state -o killed.json >log 2>&1 &
  job=$!
  sleep "$(awk -v seed="$seed" 'BEGIN { srand(seed); printf "%.2f", 0.3 + 2.5 * rand() }')"
  victims=$(pgrep -f "^$llmt_mpi d.arrow .*--checkpoint state" | sort -n) || victims=
  victim=$(printf '%s\n' "$victims" | awk -v seed="$seed" '{ pid[NR] = $1 } END { print pid[1 + seed % NR] }')
  [ -z "$victim" ] || kill -9 "$victim" 2>/dev/null || victim=
  if wait $job; then
    say "seed $seed: had ended before"
  else
    killed=$((killed + 1))
    [ ! -e killed.json ] || fail "a job that was killed left a model"
    say "seed $seed: process $victim killed, checkpoint $([ -e state ] && wc -c <state || echo none)"
    mpi 2 --checkpoint state --resume -o killed.json >log 2>&1 || fail "it did not go on: $(cat log)"
  fi
  cmp one.json killed.json || fail "other bytes after a process was killed"
done
say "$killed of $kills jobs killed, all models the same"

if mpi 2 --patience 1e-9 -o late.json 2>log; then fail "nobody lost patience"; fi
grep -q "has waited" log || fail "no word of patience: $(cat log)"
[ ! -e late.json ] || fail "a job that ended left a model"
head -c 100000 d.arrow >short.arrow && mv short.arrow d.arrow
if mpi 2 2>log; then fail "a file that was cut off was read"; fi
grep -q "d.arrow: " log || fail "the file is not named: $(cat log)"
say "all claims hold"
