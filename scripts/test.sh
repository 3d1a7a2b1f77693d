#!/usr/bin/env bash
# Installs what is needed, builds, runs every test.
#   scripts/test.sh              release preset
#   scripts/test.sh --sanitize   presets asan (address, undefined behaviour) and tsan (threads) instead
#   scripts/test.sh -- ARGS...   ARGS go to ctest, for example: scripts/test.sh -- -R rectangle
# The release preset also checks the form of the sources (scripts/lint.sh).
# Not under sanitizers: tests/install and tests/exports with the tutorials, which are about packages
# and programs of others. Under tsan only tests that start threads (tests/CMakeLists.txt).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

presets=(release)
while [[ $# -gt 0 ]]; do
  case $1 in
    --sanitize) presets=(asan tsan); shift ;;
    --) shift; break ;;
    -h | --help) sed -n '2,8s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "scripts/test.sh: unknown option '$1'; see --help" >&2; exit 2 ;;
  esac
done

failed=()
for preset in "${presets[@]}"; do
  SECONDS=0
  scripts/build.sh "$preset"
  echo "== tests, preset $preset; the build took $SECONDS s"
  ctest --preset "$preset" -j "$(nproc)" "$@" || failed+=("$preset")
done
if [[ ${presets[*]} == release ]]; then
  scripts/lint.sh || failed+=("lint")
fi
if [[ ${#failed[@]} -gt 0 ]]; then
  echo "Tests failed under: ${failed[*]}" >&2
  exit 1
fi
