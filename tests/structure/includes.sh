#!/usr/bin/env bash
# Holds the direction of the dependencies: which folder may include which, and which library only one folder may know.
# usage: includes.sh SOURCE_FOLDER
set -euo pipefail
cd "$1"
failed=0

# forbid FOLDERS PATTERN WHY: no source file under the folders has an #include that matches.
forbid() {
  local hits folder
  for folder in $1; do # a rule for what isn't there holds nothing
    [[ -d $folder ]] || { echo "includes.sh: there is no folder $folder ($3)"; failed=1; }
  done
  hits=$(grep -rnE "^[[:space:]]*#[[:space:]]*include[[:space:]]*[<\"]($2)" --include='*.h' --include='*.cpp' $1 || true)
  if [[ -n "$hits" ]]; then
    printf 'Not allowed: %s\n%s\n\n' "$3" "$hits"
    failed=1
  fi
}
# outside FOLDER ..: every folder with sources but these
outside() { find common server client -mindepth 1 -maxdepth 1 -type d | grep -vxF "$(printf '%s\n' "$@")" | sort | tr '\n' ' '; }

forbid "common" '(server|client)/' 'common includes neither server nor client'
forbid "server" 'client/|gatefield/sdk' 'the server never includes a client'
forbid "client" 'server/' 'a client never includes the server'
forbid "common server client" 'tests/|gtest|gmock' 'nothing in the product includes tests'
forbid "$(outside common/dds)" 'fast(dds|rtps|cdr)/|generated/|gatefield_idl|gatefield(PubSubTypes)?\.h' 'only common/dds includes Fast DDS and generated wire types'
forbid "$(outside common/dds common/model)" 'openssl/' 'only certificates (common/dds) and models (common/model) include OpenSSL'
forbid "$(outside server/training)" 'torch/|ATen/|c10/' 'only server/training includes libtorch'
forbid "$(outside client/simulator)" 'mujoco/' 'only client/simulator includes MuJoCo'
forbid "$(outside common/scene)" 'embree' 'only common/scene includes Embree'
forbid "$(outside server/kernels)" 'hwy/' 'only server/kernels includes Highway'
forbid "$(outside server/perception)" 'dnnl' 'only server/perception includes oneDNN'
forbid "$(outside server/training)" 'hdf5|H5' 'only server/training includes HDF5'
forbid "$(outside client/race)" 'pagmo/' 'only client/race includes pagmo'
forbid "$(outside common/base)" 'spdlog/' 'only common/base includes spdlog'
forbid "server/planner server/kernels common/geometry common/vehicle common/scene common/protocol" 'common/dds/|server/service/' \
  'pure mathematics knows no middleware'
forbid "server/gates" 'server/(kernels|perception|planner|pilot|service)/' 'what is believed of gates knows no network and no planner'
forbid "server/planner" 'server/(perception|pilot|service)/' 'the planner knows the field only through its own interface'
forbid "server/perception" 'server/(planner|pilot|service)/' 'perception makes observations; what is done with them is for others'
forbid "server/pilot" 'server/(service|app|baseline)/|server/perception/learned/|common/dds/' 'a pilot knows no service, no network and no transport'
forbid "client/sdk client/flight" 'client/(simulator|race)/' 'any vehicle flies by the SDK and the flight loop'
forbid "server/service" 'common/dds/' 'the service knows DDS only through an interface'
forbid "client/sdk" 'google/protobuf|opencv2' 'the SDK needs Fast DDS and Eigen only'

[[ $failed -eq 0 ]] && echo "Includes: every one goes the right way."
exit $failed
