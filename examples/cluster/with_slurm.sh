#!/usr/bin/env bash
# The jobs of a plan as Slurm arrays: with_slurm.sh PLAN FOLDER [options of sbatch]
set -euo pipefail
plan=$(realpath "$1") out=$(realpath "$2"); shift 2
list() { python3 -c "import json; plan = json.load(open('$plan')); $1"; }
submit() { sbatch --parsable --requeue --kill-on-invalid-dep=yes "$@"; }
pieces=$(list "print(len(plan['pieces']))") links=$(list "print(*(f'{i},{a}:{b}' for i, a, b in plan['links']))")
job=$(submit "$@" -a "0-$((pieces - 1))" --wrap "planar_map atlas submap $plan \$SLURM_ARRAY_TASK_ID -o $out")
if [[ -n $links ]]; then
  words=($links)
  job=$(submit "$@" -a "0-$((${#words[@]} - 1))" -d "afterok:$job" --wrap "
    links=($links); link=\${links[\$SLURM_ARRAY_TASK_ID]}; planar_map atlas links $plan \${link/,/ } -o $out")
fi
submit "$@" -d "afterok:$job" --wrap "planar_map atlas solve $out && planar_map atlas join $out -o $out/map.pmap"
