#!/usr/bin/env bash
# Holds the shipped models against their SHA256SUMS, which list every file that a server reads.
# usage: models.sh SOURCE_FOLDER
set -euo pipefail
cd "$1/deploy/models"
failed=0
for model in */; do
  (cd "$model" && sha256sum --check --strict --quiet SHA256SUMS) || failed=1
  for file in "$model"manifest.txt "$model"*.onnx*; do
    grep -q "  $(basename "$file")\$" "$model"SHA256SUMS || { echo "$model: SHA256SUMS does not list $(basename "$file")"; failed=1; }
  done
done
exit "$failed"
