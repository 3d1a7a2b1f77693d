#!/usr/bin/env bash
# From nothing to a map you can look at: installs packages, builds, maps, draws.
#   scripts/demo.sh                 images of a stereo camera in a generated corridor
#   scripts/demo.sh FILE.pcd...     your own clouds
#   scripts/demo.sh FOLDER          your own sequence, or one of KITTI, TUM RGB-D, EuRoC, ICL-NUIM, Middlebury
# PLANAR_MAPPING_DEMO_DIR chooses where the results go (default: out/demo below the project).
set -euo pipefail
if [[ ${1:-} == -h || ${1:-} == --help ]]; then
  sed -n '2,6s/^# \{0,1\}//p' "$0"
  exit 0
fi
inputs=()
options=(-j 0)
for input in "$@"; do
  if [[ ! -e $input ]]; then
    echo "scripts/demo.sh: '$input' does not exist; give PCD files or a sequence folder" >&2
    exit 4
  fi
  inputs+=("$(realpath "$input")")
done
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=$(realpath -m "${PLANAR_MAPPING_DEMO_DIR:-out/demo}")

scripts/build.sh release planar_map planar_map_viewer
planar_map=build/bin/planar_map
mkdir -p "$out"

loop=false
if [[ ${#inputs[@]} -eq 0 ]]; then
  loop=true
  echo "== simulating the images of a stereo camera in a corridor"
  "$planar_map" simulate corridor --write images --frames 48 --step 0.2 --yaw-deg 20 --threads 0 \
    -o "$out/sequence" --force -q
  # The camera's true poses only measure the motion that is found.
  inputs=("$out/sequence")
  options+=(--set motion_estimation.poses=ignore)
fi

arguments=("${options[@]}")
for input in "${inputs[@]}"; do arguments+=(-i "$input"); done
echo "== mapping"
"$planar_map" run "${arguments[@]}" -o "$out/map" --force > /dev/null

echo "== drawing"
map=$out/map/map.pmap
snapshot() { "$planar_map" snapshot "$map" -o "$out/$1" --force "${@:2}"; }
snapshot by_plane.png --color plane --size 1280x720
snapshot by_probability.png --color probability --show occupied,edges,trajectory,axes,legend --size 1280x720
snapshot top_view.png --projection-2d --size 1000x800

if $loop; then
  echo "== there and back by an odometer that drifts by half a metre and 5 degrees, before and after its loops are closed"
  "$planar_map" simulate corridor --write images --path back --frames 80 --odometry-drift 0.5,5 --threads 0 \
    -o "$out/way" --force -q
  rm -f "$out/loops.atlas"
  for part in before after; do
    atlas=()
    if [[ $part == after ]]; then atlas=(--atlas "$out/loops.atlas" --submap-frames 5); fi
    "$planar_map" run -j 0 "$out/way" --poses "$out/way/odometry.txt" -o "$out/loop_$part" --force -q ${atlas[@]+"${atlas[@]}"}
    "$planar_map" snapshot "$out/loop_$part/map.pmap" -o "$out/loop_$part.png" --force --color plane --size 1000x500
  done
fi

figure() { grep -m1 "\"$1\"" "$out/map/metrics.json" | sed 's/.*: *//; s/,$//'; }
cat <<TEXT

Map:      $map
          (readable: $out/map/map.json, figures: $out/map/metrics.json)
Path:     $out/map/trajectory_tum.txt
Pictures: $out/by_plane.png
          $out/by_probability.png
          $out/top_view.png
$($loop && echo "          $out/loop_before.png, $out/loop_after.png")

  planes                  $(figure planes)
  cuboids                 $(figure total)
  standard cells          $(figure standard_cells)
  combination efficiency  $(figure combination_efficiency)
  file, bytes             $(figure file_bytes)

Look at it in a window:   $planar_map view $map
TEXT
