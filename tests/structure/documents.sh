#!/usr/bin/env bash
# Holds the documents: lines of prose and of comments in sources of at most 120 characters (tables and code may be longer),
# links that lead somewhere, every room of the house in docs/architecture.md, and a changelog that begins with the version that CMakeLists.txt says.
# usage: documents.sh SOURCE_FOLDER
set -euo pipefail
export LC_ALL=C.UTF-8
cd "$1"
failed=0

while read -r page; do
  # A page that a command writes is as wide as the command makes it.
  case "$page" in docs/performance.md | docs/results/*) made=yes ;; *) made=no ;; esac
  code=no
  number=0
  while IFS= read -r line || [[ -n "$line" ]]; do
    number=$((number + 1))
    if [[ "$line" == '```'* ]]; then [[ $code == no ]] && code=yes || code=no; fi
    if [[ $made == no && $code == no && "$line" != '|'* && ${#line} -gt 120 ]]; then
      echo "$page:$number: ${#line} characters, expected at most 120"
      failed=1
    fi
  done <"$page"
  while read -r target; do
    if [[ ! -e "$(dirname "$page")/$target" ]]; then
      echo "$page: the link to '$target' leads nowhere"
      failed=1
    fi
  done < <(grep -oE '\]\([^)#: ]+' "$page" | sed 's/^](//' || true)
done < <(find README.md CONTRIBUTING.md CHANGELOG.md docs -name '*.md' | sort)

wide=$(grep -rnE '^ *//+<? [^ ]' --include='*.h' --include='*.cpp' common server client tests | grep -E ':[0-9]+:.{121,}' || true)
if [[ -n "$wide" ]]; then
  printf 'Comments of more than 120 characters:\n%s\n' "$wide"
  failed=1
fi

for house in common server client; do
  while read -r list; do
    room=$(basename "$(dirname "$list")")
    sed -n "/^| \`$house\/\` |/,/^$/p" docs/architecture.md | grep -qE "^\| [^|]*\`$room\`[^|]*\|" || {
      echo "docs/architecture.md: $house/$room is in no row of the rooms of $house"
      failed=1
    }
  done < <(find "$house" -mindepth 2 -maxdepth 2 -name CMakeLists.txt | sort)
done

version=$(sed -nE 's/^project\(gatefield VERSION ([0-9.]+) .*/\1/p' CMakeLists.txt)
newest=$(sed -nE 's/^## ([0-9.]+)( .*)?$/\1/p' CHANGELOG.md | head -n 1)
if [[ -z "$version" || "$newest" != "$version" ]]; then
  echo "CHANGELOG.md begins with '$newest', and CMakeLists.txt says version '$version'"
  failed=1
fi

[[ $failed -eq 0 ]] && echo "Documents: no line too long, no link to nowhere, version $version."
exit $failed
