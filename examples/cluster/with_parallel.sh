#!/usr/bin/env bash
# The jobs of a plan with GNU parallel: with_parallel.sh PLAN FOLDER [options of parallel, such as -S host1,host2 --wd .]
set -euo pipefail
plan=$(realpath "$1") out=$(realpath "$2"); shift 2
list() { python3 -c "import json; plan = json.load(open('$plan')); $1"; }
list "[print(i) for i in range(len(plan['pieces']))]" |
  parallel --retries 3 --halt now,fail=1 "$@" planar_map atlas submap "$plan" {} -o "$out"
planar_map atlas places "$out"
list "[print(i) for i in range(1, len(plan['pieces']))]" |
  parallel --retries 3 --halt now,fail=1 "$@" planar_map atlas links "$plan" {} -o "$out"
planar_map atlas solve "$out"
if [[ $(list "print(plan['tile_m'] > 0)") == False ]]; then exec planar_map atlas join "$out" -o "$out/map.pmap"; fi
plan="$out/survey.json" list "[print(i) for i in range(len(plan['tiles']))]" |
  parallel --retries 3 --halt now,fail=1 "$@" planar_map atlas tile "$out" {}
