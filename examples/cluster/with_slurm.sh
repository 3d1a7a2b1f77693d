#!/usr/bin/env bash
# The jobs of a plan as Slurm arrays: with_slurm.sh PLAN FOLDER [options of sbatch]
set -euo pipefail
plan=$(realpath "$1") out=$(realpath "$2"); shift 2
list() { python3 -c "import json; plan = json.load(open('$plan')); $1"; }
submit() { sbatch --parsable --requeue --kill-on-invalid-dep=yes "$@"; }
pieces=$(list "print(len(plan['pieces']))") map=$(list "print('tile' if plan['tile_m'] > 0 else 'join')")
[[ $map == tile ]] && map="tile $out" || map="join $out -o $out/map.pmap"
job=$(submit "$@" -a "0-$((pieces - 1))" --wrap "planar_map atlas submap $plan \$SLURM_ARRAY_TASK_ID -o $out")
job=$(submit "$@" -d "afterok:$job" --wrap "planar_map atlas places $out")
if ((pieces > 1)); then
  job=$(submit "$@" -a "1-$((pieces - 1))" -d "afterok:$job" --wrap "planar_map atlas links $plan \$SLURM_ARRAY_TASK_ID -o $out")
fi
submit "$@" -d "afterok:$job" --wrap "planar_map atlas solve $out && planar_map atlas $map"
