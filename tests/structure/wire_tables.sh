#!/usr/bin/env bash
# Holds the tables of docs/wire.md to the enumerations that travel on the wire: the same numbers and names, in their order.
# usage: wire_tables.sh SOURCE_FOLDER
set -euo pipefail
cd "$1"
page=docs/wire.md
failed=0

# enumerators FILE ENUM: "<number> <name>" a line.
enumerators() {
  sed -n "/^enum class $2 /,/^};/p" "$1" | sed -nE 's/^ +(k[A-Za-z0-9]+) = ([0-9]+),.*/\2 \1/p'
}

# rows SECTION: "<number> <name>" of each row "| <number> | `<name>` | ..." below that heading of the page.
rows() {
  awk -v heading="## $1" '/^## /{inside = $0 == heading} inside' "$page" | sed -nE 's/^\| ([0-9]+) \| `([a-zA-Z0-9_]+)` \|.*/\1 \2/p'
}

# same SECTION FILE: standard input is what the page has to list.
same() {
  local expected
  expected=$(cat)
  if [[ -z "$expected" ]]; then
    echo "$2: no enumerator was found"
    failed=1
  elif ! diff --label "$2" --label "$page, $1" -u <(echo "$expected") <(rows "$1"); then
    failed=1
  fi
}

same "Refusals and drops" common/base/result.h < <(enumerators common/base/result.h ErrorCode)
# Problems are called by their machine-readable names: kGateNotSeen is gate_not_seen.
same "Problems" common/protocol/problems.h < <(enumerators common/protocol/problems.h Problem | sed -E 's/ k/ /; s/ ([A-Z])/ \l\1/; s/([A-Z])/_\l\1/g')
while read -r _ name; do
  grep -qF "{\"$name\"," common/protocol/problems.cpp || { echo "common/protocol/problems.cpp: no problem is called $name"; failed=1; }
done < <(rows "Problems")

[[ $failed -eq 0 ]] && echo "Tables of the wire: as the headers have them."
exit $failed
