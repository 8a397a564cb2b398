#!/usr/bin/env bash
# Follows a page of docs/ as a reader would: writes the files that it shows and applies the changes that it shows.
#   ```cpp blocks whose first line is "// path/of/a/file"   become OUT/path/of/a/file, without that line
#   ```diff blocks                                          are applied to copies, in OUT, of the files that they name
# Files that come out as they were keep their times. Fails when a change no longer fits.
# usage: extract.sh PAGE SOURCES OUT
set -euo pipefail
page=$1 sources=$2 out=$3
new=$(mktemp -d)
trap 'rm -rf "$new"' EXIT

awk -v new="$new" '
  /^```/ { if (kind) kind = ""; else { kind = substr($0, 4); first = 1 } next }
  kind == "cpp" && first { first = 0; file = /^\/\/ [a-z0-9_\/.]+$/ ? new "/" $2 : ""
                           if (file) { folder = file; sub(/\/[^\/]*$/, "", folder); system("mkdir -p " folder) } next }
  kind == "cpp" && file { print > file }
  kind == "diff" { print > (new "/page.diff") }
' "$page"

if [[ -f "$new/page.diff" ]]; then
  sed -n 's|^--- a/||p' "$new/page.diff" | while read -r file; do
    mkdir -p "$new/$(dirname "$file")"
    cp "$sources/$file" "$new/$file"
  done
  GIT_CEILING_DIRECTORIES=$(dirname "$new") git -C "$new" apply page.diff || {
    echo "extract.sh: the changes that $page shows don't fit the sources any more" >&2
    exit 1
  }
  rm "$new/page.diff"
fi

cd "$new"
find . -type f | while read -r file; do
  cmp -s "$file" "$out/$file" && continue
  mkdir -p "$out/$(dirname "$file")"
  cp "$file" "$out/$file"
done
if [[ -d "$out" ]]; then
  cd "$out"
  find . -type f | while read -r file; do [[ -f "$new/$file" ]] || rm "$file"; done
fi
