#!/usr/bin/env bash
# Holds the table of attacks in docs/security.md to the tests: each row names some, and each that is named is there.
# usage: attack_table.sh SOURCE_FOLDER
set -euo pipefail
cd "$1"
page=docs/security.md
failed=0
rows=0

while IFS='|' read -r _ attack _ _ tests _; do
  rows=$((rows + 1))
  # shellcheck disable=SC2016 # names stand between backticks there
  names=$(grep -oE '`[A-Z][A-Za-z0-9]+`' <<<"$tests" | tr -d '`' || true)
  if [[ -z "$names" ]]; then
    echo "$page: no test is named for the attack:$attack"
    failed=1
  fi
  for name in $names; do
    grep -rqE "^TEST(_F|_P)?\([A-Za-z0-9]+, $name\)" tests --include='*_test.cpp' || {
      echo "$page: there is no test $name, which it names for the attack:$attack"
      failed=1
    }
  done
done < <(awk '/^## /{inside = $0 == "## Attacks"} inside && /^\| / && !/^\| (attack|---)/' "$page")

if [[ $rows -eq 0 ]]; then
  echo "$page: no row of attacks was found"
  failed=1
fi
[[ $failed -eq 0 ]] && echo "Attacks: $rows rows, each with its tests."
exit $failed
