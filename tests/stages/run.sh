#!/usr/bin/env bash
# Runs the stages of `make test`, the cheapest first, and ends with a table of their seconds. Stops at the first failed
# stage. A stage may write lines to $NOTES:
# * tests that it left out, with the command that installs their requirements;
# * tests that passed only on a second run.
#
# usage: run.sh STAGE...   (each is a make target)
set -uo pipefail

NOTES="$(mktemp)"
export NOTES
trap 'rm --force "$NOTES"' EXIT
rows=()
TIMEFORMAT='%R %U %S'
exit_code=0
for stage in "$@"; do
  printf '\n== %s\n' "$stage"
  { seconds="$( { time "${MAKE:-make}" --no-print-directory "$stage" >&3 2>&4; } 2>&1)"; } 3>&1 4>&2
  code=$?
  # The last line is the output of `time`.
  read -r wall user sys <<<"$(tail --lines 1 <<<"$seconds")"
  result=passed
  [ "$code" -eq 0 ] || result=FAILED
  rows+=("$(printf '%-14s %-7s %8.0f %13.0f' "$stage" "$result" "$wall" "$(awk "BEGIN { print $user + $sys }")")")
  if [ "$code" -ne 0 ]; then
    exit_code=1
    break
  fi
done
printf '\n%-14s %-7s %8s %13s\n' stage result seconds core-seconds
printf '%s\n' "${rows[@]}"
if [ -s "$NOTES" ]; then
  printf '\n'
  cat "$NOTES"
fi
exit "$exit_code"
