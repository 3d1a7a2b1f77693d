#!/usr/bin/env bash
# Configures and builds one preset, or only some of its targets. Quick when nothing changed.
#   scripts/build.sh [release|dev|asan|tsan|core-only [TARGET...]]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
preset=${1:-release}
targets=("${@:2}")
if [[ ${#targets[@]} -gt 0 ]]; then  # the demonstration needs no tools of tests
  scripts/install_dependencies.sh --build-only
else
  scripts/install_dependencies.sh
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if ! cmake --preset "$preset" >"$log" 2>&1; then
  cat "$log" >&2
  echo "Configuring the preset '$preset' failed; the reason is above." >&2
  exit 1
fi
cmake --build --preset "$preset" ${targets[@]+--target "${targets[@]}"}
