#!/usr/bin/env bash
# Runs the stages of `make test`, the cheapest first, and ends with a table of their seconds. Stops at the first failed
# stage. Stages that a plus joins run at the same time, and each prints its output when it ends.
# A stage may write lines to $NOTES:
# * tests that it left out, with the command that installs their requirements;
# * tests that passed only on a second run.
#
# usage: run.sh STAGE[+STAGE...]...   (each is a make target)
set -uo pipefail

folder="$(mktemp --directory)"
trap 'rm --force --recursive "$folder"' EXIT
# Stages that run at the same time have process groups of their own, which Ctrl-C does not reach.
trap 'for job in $(jobs -p); do kill -- -"$job"; done; exit 130' INT TERM
export NOTES="$folder/notes"
touch "$NOTES"
TIMEFORMAT='%R %U %S'

# Runs one stage, and writes its line of the table and its exit code to files.
run() {
  local stage="$1" seconds code wall user sys result=passed
  printf '\n== %s\n' "$stage"
  { seconds="$( { time "${MAKE:-make}" --no-print-directory "$stage" >&3 2>&4; } 2>&1)"; } 3>&1 4>&2
  code=$?
  # The last line is the output of `time`.
  read -r wall user sys <<<"$(tail --lines 1 <<<"$seconds")"
  [ "$code" -eq 0 ] || result=FAILED
  printf '%-14s %-7s %8.0f %13.0f\n' "$stage" "$result" "$wall" "$(awk "BEGIN { print $user + $sys }")" \
    >"$folder/$stage.row"
  return "$code"
}

rows=()
exit_code=0
for group in "$@"; do
  read -r -a stages <<<"${group//+/ }"
  if [ "${#stages[@]}" -eq 1 ]; then
    run "$group" || exit_code=1
  else
    set -m
    for stage in "${stages[@]}"; do
      { run "$stage" >"$folder/$stage.log" 2>&1; code=$?; cat "$folder/$stage.log"; exit "$code"; } &
    done
    set +m
    for _ in "${stages[@]}"; do
      wait -n || exit_code=1
    done
  fi
  for stage in "${stages[@]}"; do
    rows+=("$(cat "$folder/$stage.row")")
  done
  [ "$exit_code" -eq 0 ] || break
done
printf '\n%-14s %-7s %8s %13s\n' stage result seconds core-seconds
printf '%s\n' "${rows[@]}"
if [ -s "$NOTES" ]; then
  printf '\n'
  cat "$NOTES"
fi
exit "$exit_code"
