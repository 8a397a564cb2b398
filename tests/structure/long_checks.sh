#!/usr/bin/env bash
# Holds docs/long-checks.md and deploy/long-check: every command of the table exists, and a run is written down when,
# and only when, it succeeded.
# usage: long_checks.sh SOURCE_FOLDER
set -euo pipefail
cd "$1"
failed=0
fail() { echo "$1"; failed=1; }

names=0
while IFS= read -r row; do
  names=$((names + 1))
  name=$(sed -E 's/^\| `([^`]*)`.*/\1/' <<<"$row")
  command=$(sed -E 's/^\| `[^`]*` \| `([^`]*)` \|.*/\1/' <<<"$row")
  known=0
  for word in $(tr '"' ' ' <<<"$command"); do
    case "$word" in
      deploy/* | tests/*) [[ -x $word ]] && known=1 || fail "$name: $word is no program" ;;
      build/release/bin/*) grep -rqE "gatefield_program\(${word##*/}( |\$)" --include=CMakeLists.txt client server && known=1 ||
        fail "$name: nothing builds $word" ;;
      build/release/tests/*)
        folder=${word#build/release/}
        grep -q "gatefield_test(${word##*/} " "${folder%/*}/CMakeLists.txt" && known=1 || fail "$name: nothing builds $word" ;;
    esac
  done
  [[ $known -eq 1 ]] || fail "$name: its command '$command' names no program of ours"
  [[ $(deploy/long-check | grep -c "^$name ") -eq 1 ]] || fail "deploy/long-check lists $name not exactly once"
done < <(grep -E '^\| `' docs/long-checks.md)
[[ $names -gt 0 ]] || fail "docs/long-checks.md: no check was found"

# A table of its own, with one check that passes and one that doesn't.
try=$(mktemp -d)
trap 'rm -rf "$try"' EXIT
mkdir -p "$try/deploy" "$try/docs"
cp deploy/long-check "$try/deploy/"
good='| `good` | `true` | | | - | - |' bad='| `bad` | `exit 7` | | | - | - |'
printf '%s\n' "$good" "$bad" >"$try/docs/long-checks.md"
git -C "$try" init -q
git -C "$try" add .
git -C "$try" -c user.name=test -c user.email=test@localhost commit -qm try
"$try/deploy/long-check" good >/dev/null || fail "a check that passes: exit code $?"
grep -qE '^\| `good` \| `true` \| \| \| [0-9]{4}-[0-9]{2}-[0-9]{2} \| [0-9a-f]+ \|$' "$try/docs/long-checks.md" ||
  fail "a check that passed was not written down: $(head -n 1 "$try/docs/long-checks.md")"
code=0
"$try/deploy/long-check" bad >/dev/null 2>&1 || code=$?
[[ $code -eq 7 ]] || fail "a check that fails with 7: exit code $code"
grep -qxF "$bad" "$try/docs/long-checks.md" || fail "a check that failed was written down"
code=0
"$try/deploy/long-check" none >/dev/null 2>&1 || code=$?
[[ $code -eq 2 ]] || fail "a check that isn't there: exit code $code"

[[ $failed -eq 0 ]] && echo "Long checks: $names, and each command exists."
exit $failed
