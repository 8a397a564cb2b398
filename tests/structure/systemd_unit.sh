#!/usr/bin/env bash
# Holds the server's unit file: systemd understands every line, and what it leaves open stays below 2.0 of 10.
# usage: systemd_unit.sh UNIT PROGRAM
set -euo pipefail
if ! command -v systemd-analyze >/dev/null; then
  echo "left out: there is no systemd-analyze"
  exit 77
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
unit=$work/gatefield-server.service
sed "s|^ExecStart=[^ ]*|ExecStart=$2|" "$1" >"$unit"
complaints=$(systemd-analyze verify "$unit" 2>&1 | grep gatefield || true)
if [[ -n "$complaints" ]]; then
  echo "$complaints"
  exit 1
fi
systemd-analyze security --offline=true --threshold=20 --no-pager "$unit" | tail -n 1
