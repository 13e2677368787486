#!/bin/sh
# gate.sh BUILD_BIN MOST_MISSED: generates the short plan, lets BUILD_BIN/llmt-robot look at it and judges the answers. Fails on
# a false alarm, a confidently wrong name, a case without an answer, or more than MOST_MISSED visible effects missed.
set -eu
[ $# -eq 2 ] || { sed -n '2,3s/^# //p' "$0" >&2; exit 2; }
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
"$1/blind_generate" --plan gate -o "$folder/cases"
sh "$(dirname "$0")/run.sh" "$1/llmt-robot" "$folder/cases" "$folder/results" 2
"$1/blind_score" "$folder/cases" "$folder/results" --no-gap --most-missed "$2"
