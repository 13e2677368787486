#!/bin/sh
# strangers.sh BUILD_BIN FOLDER [CASES] [SEED]: writes CASES cases (200) of seed SEED (1), lets BUILD_BIN/llmt-robot look at them
# and prints counts per class. A run of 200 takes some minutes; what is there already is not done again.
set -eu
[ $# -ge 2 ] || { sed -n '2,3s/^# //p' "$0" >&2; exit 2; }
[ -d "$2/cases" ] || "$1/blind_strangers" --cases "${3:-200}" --seed "${4:-1}" -o "$2/cases"
sh "$(dirname "$0")/run.sh" "$1/llmt-robot" "$2/cases" "$2/results" 2
"$1/blind_strangers_score" "$2/cases" "$2/results"
