#!/usr/bin/env bash
# Holds the names of random streams: each is used in one place, and is among those whose keys random_test holds apart.
# usage: streams.sh SOURCE_FOLDER
set -euo pipefail
cd "$1"
failed=0
test=tests/unit/common/base/random_test.cpp
names=$(grep -rhoE 'Stream\("[^"]+"\)' --include='*.h' --include='*.cpp' common server client | sort)
if [[ -z "$names" ]]; then
  echo "no stream has a name"
  failed=1
fi
twice=$(uniq -d <<<"$names")
if [[ -n "$twice" ]]; then
  echo "used in two places, expected a name for each: $twice"
  failed=1
fi
while read -r name; do
  grep -qF "$name" "$test" || { echo "$test does not list $name"; failed=1; }
done <<<"$names"

[[ $failed -eq 0 ]] && echo "Streams: $(wc -l <<<"$names") names, each used once."
exit $failed
