#!/bin/sh
# run.sh BIN DIR RESULTS [JOBS]: lets the tool BIN (llmt-robot) look at every case in DIR, two at a time. Cases that have a
# result are skipped, so an interrupted run goes on. The tool never sees DIR/truth. What it refuses stays in <case>.error.
set -eu
[ $# -ge 3 ] || { sed -n '2,3s/^# //p' "$0" >&2; exit 2; }
mkdir -p "$3"
BIN=$1 DIR=$2 RESULTS=$3
export BIN DIR RESULTS
find "$DIR" -mindepth 1 -maxdepth 1 -type d ! -name truth -printf '%f\n' | sort | xargs -P "${4:-2}" -I{} sh -c '
  out=$RESULTS/$1
  [ ! -s "$out.json" ] || exit 0
  start=$(date +%s.%N)
  if "$BIN" discover "$DIR/$1/robot.yaml" "$DIR/$1/measured.csv" --test "$DIR/$1/heldout.csv" -o "$out.yaml" --json \
      >"$out.part" 2>"$out.error"; then
    end=$(date +%s.%N)
    echo "$start $end" | awk "{print \$2 - \$1}" >"$out.seconds"
    mv "$out.part" "$out.json"
    rm -f "$out.error"
  else
    rm -f "$out.part"
    echo "refused: $1" >&2
  fi
' sh {}
