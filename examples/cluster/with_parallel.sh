#!/usr/bin/env bash
# The jobs of a plan with GNU parallel: with_parallel.sh PLAN FOLDER [options of parallel, such as -S host1,host2 --wd .]
set -euo pipefail
plan=$(realpath "$1") out=$(realpath "$2"); shift 2
list() { python3 -c "import json; plan = json.load(open('$plan')); $1"; }
list "[print(i) for i in range(len(plan['pieces']))]" |
  parallel --retries 3 --halt now,fail=1 "$@" planar_map atlas submap "$plan" {} -o "$out"
list "[print(i, f'{a}:{b}') for i, a, b in plan['links']]" |
  parallel --retries 3 --halt now,fail=1 --colsep ' ' "$@" planar_map atlas links "$plan" {1} {2} -o "$out"
planar_map atlas solve "$out"
planar_map atlas join "$out" -o "$out/map.pmap"
