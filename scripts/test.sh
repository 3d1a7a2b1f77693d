#!/usr/bin/env bash
# Installs what is needed, builds, runs every test.
#   scripts/test.sh              release preset
#   scripts/test.sh --sanitize   the asan+ubsan and the tsan preset as well, each its own ctest run
#   scripts/test.sh -- ARGS...   ARGS go to ctest, for example: scripts/test.sh -- -R rectangle
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

presets=(release)
while [[ $# -gt 0 ]]; do
  case $1 in
    --sanitize) presets+=(asan tsan); shift ;;
    --) shift; break ;;
    -h | --help) sed -n '2,5s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "scripts/test.sh: unknown option '$1'; see --help" >&2; exit 2 ;;
  esac
done

failed=()
for preset in "${presets[@]}"; do
  scripts/build.sh "$preset"
  echo "== tests, preset $preset"
  ctest --preset "$preset" -j "$(nproc)" "$@" || failed+=("$preset")
done
if [[ ${#failed[@]} -gt 0 ]]; then
  echo "Tests failed under: ${failed[*]}" >&2
  exit 1
fi
