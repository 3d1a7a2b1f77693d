#!/usr/bin/env bash
# Everything that docs/results.md tells of, in one folder: tables, figures, one summary.
#   scripts/reproduce.sh [OUT]        default: out/evaluation below the project
#   scripts/reproduce.sh OUT --quick  two places of five frames: looks right in a few minutes
# Recorded sequences are taken from PLANAR_MAPPING_DATA (default: ../shared/data) where they are.
# PLANAR_MAPPING_JOBS places are judged beside each other (default 1: times are of one thread).
set -euo pipefail
if [[ ${1:-} == -h || ${1:-} == --help ]]; then
  sed -n '2,6s/^# \{0,1\}//p' "$0"
  exit 0
fi
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=$(realpath -m "${1:-out/evaluation}")
quick=()
[[ ${2:-} == --quick ]] && quick=(--places 2 --frames-per-place 5)
data=$(realpath -m "${PLANAR_MAPPING_DATA:-../shared/data}")
jobs=${PLANAR_MAPPING_JOBS:-1}
planar_map=${PLANAR_MAPPING_PROGRAM:-build/bin/planar_map}
if [[ -z ${PLANAR_MAPPING_PROGRAM:-} ]]; then scripts/build.sh release; fi
mkdir -p "$out"
parts=()

# evaluate NAME CONFIG OPTIONS...: one evaluation in a folder of its own. Tables without pictures
# (exit code 7: nothing here can draw) are results, too.
evaluate() {
  local name=$1 config=$2 code=0
  shift 2
  echo "== $name"
  # The same cover with all points as clutter: what planes buy is a column of the tables.
  [[ $name == ablation ]] || set -- "$@" --variant no_planes:multi_plane_segmentation.enabled=false
  "$planar_map" evaluate "$config" "$@" ${quick[@]+"${quick[@]}"} -j "$jobs" -q --force -o "$out/$name" || code=$?
  [[ $code -eq 0 || $code -eq 7 ]] || exit "$code"
  parts+=("$name")
}

# Thresholds between a frame and the map follow the cell size; poses are those of the data set.
follow=(--set planar_cuboid_approximation.association_offset_m=auto
        --set planar_cuboid_approximation.association_gap_m=auto)

# Recorded sequences are judged by what they cover of points held back: what few points or looks
# confirm is kept, at the price of more cuboids. The configurations as they are rather keep maps steady.
stage=planar_cuboid_approximation
thin=(--set $stage.min_cell_share=0.07)
complete=(--set $stage.min_cell_share=0 --set $stage.min_probability=0.2 --set $stage.noise_factor=0)

evaluate simulated config/evaluate.yaml
evaluate simulated_turned config/evaluate.yaml --scenes corridor --yaw-deg 30
for set in rgbd_tum_cabinet rgbd_tartanair_corridor rgbd_icl_livingroom rgbd_icl_five; do
  if [[ -d $data/$set ]]; then
    evaluate "$set" config/rgbd_indoor.yaml -i "$data/$set" "${follow[@]}" "${thin[@]}"
  fi
done
if [[ -d $data/stereo_euroc_room ]]; then
  evaluate stereo_euroc_room config/stereo_indoor.yaml -i "$data/stereo_euroc_room" "${follow[@]}" "${complete[@]}"
fi
if [[ -d $data/stereo_kitti_street ]]; then
  evaluate stereo_kitti_street config/stereo_outdoor.yaml -i "$data/stereo_kitti_street" "${complete[@]}"
fi

# The share of each idea, at one cell size; its evaluation.* repeat a part of the above.
evaluate ablation config/evaluate.yaml --ablation --cells 0.1 --places 4 --no-figures
unset 'parts[-1]'

# One table to include elsewhere: the facts once, then every input.
{
  sed -n '/^### /q;p' "$out/${parts[0]}/evaluation.md"
  for part in "${parts[@]}"; do sed -n '/^### /,$p' "$out/$part/evaluation.md"; echo; done
  echo "## Ablation"
  echo
  sed -n '/^### /,$p' "$out/ablation/ablation.md"
} > "$out/summary.md.tmp"
mv "$out/summary.md.tmp" "$out/summary.md"
echo "$out/summary.md"
