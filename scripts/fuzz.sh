#!/usr/bin/env bash
# Builds the fuzz targets with clang's libFuzzer, address and undefined behaviour sanitizers (preset fuzz) and runs them
# one after the other:
#   scripts/fuzz.sh MINUTES [TARGET...]      all targets in MINUTES together, or those named
# Prints executions, coverage and findings. Grown inputs stay in build-fuzz/corpus, those that found something in
# build-fuzz/findings. A finding becomes a file of tests/fuzz/corpus once it is mended. Code 1 if there is any.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
[[ ${1:-} =~ ^[0-9]+(\.[0-9]+)?$ ]] || { sed -n '2,6s/^# \{0,1\}//p' "$0"; exit 2; }
minutes=$1; shift
command -v clang++ >/dev/null || { echo "clang is missing: scripts/install_dependencies.sh --fuzz" >&2; exit 1; }
names=("$@")
[[ ${#names[@]} -gt 0 ]] || names=(cloud image poses calibration configuration message layouts map plan insert atlas session)
cmake --preset fuzz >/dev/null
cmake --build --preset fuzz --target "${names[@]/#/fuzz_}" >/dev/null

seconds=$(awk "BEGIN { s = 60 * $minutes / ${#names[@]}; print s < 1 ? 1 : int(s) }")
found=0; all=0
mkdir -p build-fuzz/findings
printf '%-14s %12s %8s %7s %9s\n' target executions edges inputs findings
for name in "${names[@]}"; do
  grown=build-fuzz/corpus/$name
  inputs=("tests/fuzz/corpus/$name")
  [[ $name != configuration ]] || inputs+=(config)
  log=build-fuzz/$name.log
  mkdir -p "$grown"
  before=$(find build-fuzz/findings -name "$name-*" | wc -l)
  executions=0; edges=0
  end=$((SECONDS + seconds))
  while [[ $SECONDS -lt $end ]]; do  # a finding ends the program
    "build-fuzz/tests/bin/fuzz_$name" "$grown" "${inputs[@]}" -max_total_time=$((end - SECONDS)) -entropic=0 \
      -timeout=60 -report_slow_units=60 -rss_limit_mb=3000 -print_final_stats=1 -artifact_prefix="build-fuzz/findings/$name-" \
      >"$log" 2>&1 || true
    executions=$((executions + $(awk '/number_of_executed_units/ { print $2 }' "$log") + 0))
    edges=$(grep -o 'cov: [0-9]*' "$log" | tail -1 | cut -d' ' -f2)
  done
  findings=$(($(find build-fuzz/findings -name "$name-*" | wc -l) - before))
  printf '%-14s %12d %8d %7d %9d\n' "$name" "$executions" "$edges" "$(find "$grown" -type f | wc -l)" "$findings"
  all=$((all + executions)); found=$((found + findings))
done
echo "$all executions, $found findings"
[[ $found -eq 0 ]]
