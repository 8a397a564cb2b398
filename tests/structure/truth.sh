#!/usr/bin/env bash
# Looks into a built program for what knows the truth: no function or variable that one of the libraries defines may be
# in it.
# usage: truth.sh free|holds PROGRAM LIBRARY...
# 'holds': the program must have some; it shows that the search finds them.
set -euo pipefail
expected=$1
program=$2
shift 2

# Functions and variables that others can link to, by their mangled names; what is inline (weak) may be in any program.
symbols() { nm --defined-only "$@" 2>/dev/null | awk 'NF == 3 && $2 ~ /^[TBDRG]$/ { print $3 }' | sort -u; }
of_truth=$(symbols "$@")
if [[ $(wc -l <<<"$of_truth") -lt 10 ]]; then
  echo "The libraries that know the truth define hardly anything: is this the right list? $*" >&2
  exit 1
fi
found=$(comm -12 <(echo "$of_truth") <(symbols "$program") | c++filt)
count=$(grep -c . <<<"$found" || true)

case "$expected" in
  free)
    if [[ $count -gt 0 ]]; then
      printf '%s must not know the truth and holds %d of its symbols:\n%s\n' "$program" "$count" "$(head -n 20 <<<"$found")"
      exit 1
    fi
    echo "None of $(wc -l <<<"$of_truth") symbols that know the truth is in $program."
    ;;
  holds)
    if [[ $count -eq 0 ]]; then
      echo "$program should hold symbols that know the truth, and none was found: the search is blind." >&2
      exit 1
    fi
    echo "$program holds $count symbols that know the truth, as it should."
    ;;
  *)
    echo "truth.sh: '$expected' is neither free nor holds" >&2
    exit 2
    ;;
esac
