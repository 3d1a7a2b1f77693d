#!/usr/bin/env bash
# Maps beside a grid, an octree and rectangular cuboids (docs/results.md), in one folder: tables, figures, one summary.
#   scripts/reproduce.sh [OUT] [PART...]   default: out/evaluation below the project, all parts
#   scripts/reproduce.sh OUT --quick       two places of five frames, no whole sequences: looks right in minutes
# Parts: methods, seeds, regimes, poses, ablation. Configurations are those of config/ as they are, only the
# cell size varies. Recorded sequences are taken from PLANAR_MAPPING_DATA (default: ../shared/data) where they are.
# PLANAR_MAPPING_JOBS places are judged beside each other (default 1: times are of one thread).
# Tables of docs/results.md that this does not make: motion (scripts/motion_table.py), GMMap (benchmarks/gmmap_peer),
# free and unknown space (ctest -R ObservedSpace -V), planes of stereo pairs and white walls (ctest -R WhiteWalls -V and
# others), planes of clouds (compare_plane_quality, compare_planes), updates of beliefs
# (belief_roc, map_experiments), single clouds (planar_map run), disparities and speed (benchmark_*). Their commands stand
# beside them there.
set -euo pipefail
if [[ ${1:-} == -h || ${1:-} == --help ]]; then
  sed -n '2,12s/^# \{0,1\}//p' "$0"
  exit 0
fi
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=$(realpath -m "${1:-out/evaluation}")
parts=" ${*:2} "
[[ $# -gt 1 ]] || parts=" methods regimes seeds poses ablation "
quick=() few=(--places 4)
if [[ $parts == *" --quick "* ]]; then
  quick=(--places 2 --frames-per-place 5) few=()
  parts=" methods regimes seeds ablation "
fi
for part in $parts; do
  [[ " methods regimes seeds poses ablation " == *" $part "* ]] || { echo "there is no part '$part'" >&2; exit 2; }
done
data=$(realpath -m "${PLANAR_MAPPING_DATA:-../shared/data}")
jobs=${PLANAR_MAPPING_JOBS:-1}
planar_map=${PLANAR_MAPPING_PROGRAM:-build/bin/planar_map}
if [[ -z ${PLANAR_MAPPING_PROGRAM:-} ]]; then scripts/build.sh release; fi
mkdir -p "$out"

# evaluate NAME CONFIG OPTIONS...: one evaluation in a folder of its own. Tables without pictures
# (exit code 7: nothing here can draw) are results, too.
evaluate() {
  local name=$1 config=$2 code=0
  shift 2
  echo "== $name"
  "$planar_map" evaluate "config/$config.yaml" "$@" ${quick[@]+"${quick[@]}"} -j "$jobs" -q --force -o "$out/$name" || code=$?
  [[ $code -eq 0 || $code -eq 7 ]] || exit "$code"
}

# The same cover with all points as clutter: what planes buy is a column of the tables.
boxes=(--variant no_planes:multi_plane_segmentation.enabled=false)

# inputs PREFIX OPTIONS...: all scenes and sequences that are there.
inputs() {
  local prefix=$1 set
  shift
  evaluate "${prefix}simulated" evaluate "$@"
  evaluate "${prefix}simulated_turned" evaluate --scenes corridor --yaw-deg 30 "$@"
  for set in rgbd_indoor:rgbd_{tum_cabinet,tartanair_corridor,icl_livingroom,icl_five} \
    stereo_indoor:stereo_euroc_room stereo_outdoor:stereo_kitti_street; do
    [[ -d $data/${set#*:} ]] || continue
    evaluate "$prefix${set#*:}" "${set%:*}" -i "$data/${set#*:}" "$@"
  done
}

if [[ $parts == *" methods "* ]]; then inputs "" "${boxes[@]}"; fi

# Exact and tolerant covers, with and without the filters, of all methods.
if [[ $parts == *" regimes "* ]]; then inputs regimes_ --regimes --cells 0.1 ${few[@]+"${few[@]}"} --no-figures; fi

# Noise, and for white walls the layout, of five seeds.
if [[ $parts == *" seeds "* ]]; then
  for seed in 1 2 3 4 5; do
    evaluate "seed_$seed" evaluate --seed "$seed" --scenes corridor,outdoor,white --cells 0.1,0.3 \
      ${few[@]+"${few[@]}"} --no-figures "${boxes[@]}"
  done
fi

# Whole sequences, with given poses and with those found from the images.
if [[ $parts == *" poses "* ]]; then
  "$planar_map" simulate corridor --write images --frames 40 --step 0.2 --seed 7 -q --force -o "$out/simulated_images"
  for set in stereo_indoor:"$out/simulated_images" \
    rgbd_indoor:"$data"/rgbd_{tum_cabinet,tartanair_corridor,icl_livingroom} \
    stereo_indoor:"$data/stereo_euroc_room" stereo_outdoor:"$data/stereo_kitti_street"; do
    [[ -d ${set#*:} ]] || continue
    for poses in use ignore; do
      evaluate "poses_${poses}_$(basename "$set")" "${set%%:*}" -i "${set#*:}" --cells 0.1,0.2 --frames-per-place 0 \
        --set motion_estimation.poses=$poses --no-figures "${boxes[@]}"
    done
  done
fi

# The fraction of each idea, at one cell size; its evaluation.* repeat a part of the above.
if [[ $parts == *" ablation "* ]]; then
  evaluate ablation evaluate --ablation --cells 0.1 ${few[@]+"${few[@]}"} --no-figures
fi

# One table to include elsewhere: the facts once, then every input.
cat "$out"/*/evaluation.md | awk '!/^- / || !seen[$0]++' > "$out/summary.md.tmp"
if [[ -d $out/ablation ]]; then
  printf '\n## Ablation\n' >> "$out/summary.md.tmp"
  sed -n '/^### /,$p' "$out/ablation/ablation.md" >> "$out/summary.md.tmp"
fi
mv "$out/summary.md.tmp" "$out/summary.md"
echo "$out/summary.md"
