#!/usr/bin/env bash
# Holds what is installed: every rule belongs to a component, and the data (configuration, models) go where programs
# look for them, each file once, without the evaluations.
# usage: installed.sh BUILD_FOLDER
set -euo pipefail
build=$1
failed=0
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

if grep -rl --include=cmake_install.cmake 'STREQUAL "Unspecified"' "$build"/{common,server,client} 2>/dev/null; then
  echo "An install() of these folders names no COMPONENT, expected server, simulator, tools, training, sdk, python or data."
  failed=1
fi

cmake --install "$build" --component data --prefix "$folder" >"$folder/log"
installed=$(sed -nE 's/^-- (Installing|Up-to-date): //p' "$folder/log")
twice=$(while read -r path; do if [[ -f $path ]]; then echo "${path#"$folder"/}"; fi; done <<<"$installed" | sort | uniq -d)
if [[ -n "$twice" ]]; then
  printf 'Installed twice:\n%s\n' "$twice"
  failed=1
fi
for file in share/gatefield/config/courses/circle.txt share/gatefield/models/race/manifest.txt; do
  [[ -f "$folder/$file" ]] || { echo "$file is not installed"; failed=1; }
done
if find "$folder" -path '*/evaluation*' | grep .; then
  echo "Evaluations of models are for people, and are not installed."
  failed=1
fi

[[ $failed -eq 0 ]] && echo "Installed: every rule has a component, $(find "$folder/share" -type f | wc -l) files of data, each once."
exit $failed
