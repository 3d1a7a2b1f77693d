#!/usr/bin/env bash
# Builds gmmap_peer, and GMMap's library with it, in the folder that is named.
#   benchmarks/gmmap_peer/build.sh GMMAP DIR [PREFIX]     GMMAP: a clone of github.com/mit-lean/GMMap; PREFIX: where planar_mapping is installed
# Needs libfmt-dev, libeigen3-dev, libyaml-cpp-dev.
set -euo pipefail
here=$(dirname "$(realpath "${BASH_SOURCE[0]}")")
gmmap=${1:?the clone of GMMap}
out=${2:?the folder to build in}
prefix=${3:-/usr/local}
mkdir -p "$out"
includes=(-I "$gmmap/include" -I "$gmmap/libs/rtree/include" -I "$gmmap/libs/nigh/src")
for name in cluster_serialize map_serialize cluster_ops SPGFExtended map map_param; do
  g++ -std=c++17 -O2 -fopenmp -w "${includes[@]}" -isystem /usr/include/eigen3 -c "$gmmap/src/gmm_map/$name.cpp" -o "$out/$name.o"
done
g++ -std=c++17 -O2 -fopenmp -w "${includes[@]}" -I "$prefix/include" -isystem /usr/include/eigen3 "$here/gmmap_peer.cpp" "$out"/*.o \
  -L "$prefix/lib" -Wl,-rpath,"$(realpath "$prefix")/lib" -lplanar_mapping_io -lplanar_mapping_map -lplanar_mapping_core -lyaml-cpp -o "$out/gmmap_peer"
