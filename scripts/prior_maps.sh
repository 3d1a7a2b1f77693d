#!/usr/bin/env bash
# Makes src/map/src/prior_maps.cpp or prior_finished_maps.cpp: the maps a coder of .pmap or .pbox
# files has read before it starts (docs/file_format.md, "Prior maps"), of simulated scenes that no
# evaluation uses. Only for a new version of the format: files of the version before cannot be read
# any more.
#   scripts/prior_maps.sh pmap|pbox   takes a minute; compiles the program without and with them
set -euo pipefail
kind=${1:-}
if [[ $kind != pmap && $kind != pbox ]]; then
  sed -n '2,6s/^# \{0,1\}//p' "$0"
  [[ $kind == -h || $kind == --help ]]
  exit
fi
cd "$(dirname "${BASH_SOURCE[0]}")/.."
planar_map=${PLANAR_MAPPING_PROGRAM:-build/bin/planar_map}
writer=${PLANAR_MAPPING_PRIOR_WRITER:-build/tests/prior_maps_writer}
target=src/map/src/prior_maps.cpp
[[ $kind == pmap ]] || target=src/map/src/prior_finished_maps.cpp
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

# Files of the program without prior maps are what the writer reads.
build() { cmake --build --preset release --target planar_map prior_maps_writer > /dev/null; }
build
"$writer" "$kind" > "$out/none.cpp"
cp "$out/none.cpp" "$target"
build

for scene in room rooms; do
  "$planar_map" simulate "$scene" --frames 40 --seed 7 --yaw-deg 17 -o "$out/$scene" -q
done

# map NAME SCENE CONFIG CELL FIRST: ten frames of a scene.
maps=()
map() {
  local name=$1 scene=$2 config=$3 cell=$4 first=$5
  "$planar_map" run "$config" -i "$out/$scene" -o "$out/$name" --frames "$first:$((first + 10))" -q \
    --set kl_occupancy.resolution_m="$cell" --set planar_cuboid_approximation.resolution_m="$cell" \
    --set planar_cuboid_approximation.association_offset_m=auto \
    --set planar_cuboid_approximation.association_gap_m=auto
  [[ $kind == pmap ]] || "$planar_map" convert "$out/$name/map.pmap" "$out/$name/map.pbox"
  maps+=("$out/$name/map.$kind")
}
# Fine ones first: what is learnt last counts most, and small files need it most.
map fine_evaluated rooms config/evaluate.yaml 0.1 25
map fine rooms config/pcd_sequence.yaml 0.1 20
map middle room config/pcd_sequence.yaml 0.2 10
map middle_evaluated room config/evaluate.yaml 0.2 20
map coarse_rgbd room config/rgbd_indoor.yaml 0.3 10
map coarse_evaluated rooms config/evaluate.yaml 0.3 5
map coarser_evaluated room config/evaluate.yaml 0.4 0
map coarsest room config/pcd_sequence.yaml 0.5 20
"$writer" "$kind" "${maps[@]}" > "$out/prior_maps.cpp"
cp "$out/prior_maps.cpp" "$target"
build
