// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Planes from key features, from dense points, or from both, on simulated stereo frames of which
// one knows the planes: prints the table of docs/results.md.
//
//   compare_plane_sources [frames] [features]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "evaluation/metrics/simulated_features.h"
#include "planar_mapping/planes/multi_plane.h"
#include "evaluation/simulation/simulation.h"

namespace {

using planar_mapping::KeyFeature;
using planar_mapping::MultiPlaneParams;
using planar_mapping::PlaneSearchMethod;
using planar_mapping::PlaneSet;
using planar_mapping::PointsView;
using planar_mapping::evaluation::SimulatedFrame;
using planar_mapping::evaluation::Simulation;

constexpr double kOverlap = 0.8;
constexpr std::size_t kMinFraction = 300;  ///< of the points, that a plane must have to count

/// Sums over frames.
struct Score {
  double true_planes = 0, found = 0, segments = 0, right = 0;
};

/// A true plane is found if one segment holds 80 % of its points; a segment is right if 80 % of its
/// points are of one plane that it found.
void check(const SimulatedFrame& frame, const PlaneSet& set, std::size_t least, Score& score) {
  std::map<std::uint32_t, std::size_t> sizes;
  for (std::size_t i = 0; i < frame.labels.size(); ++i) {
    if (frame.labels[i] > 0 && std::isfinite(frame.xyz[3 * i])) ++sizes[frame.labels[i]];
  }
  for (auto it = sizes.begin(); it != sizes.end();) {
    it = it->second < least ? sizes.erase(it) : std::next(it);
  }
  std::map<std::uint32_t, std::size_t> most;
  for (const planar_mapping::PlaneSegment& segment : set.planes) {
    std::map<std::uint32_t, std::size_t> held;
    for (const int i : segment.inliers) ++held[frame.labels[static_cast<std::size_t>(i)]];
    score.segments += 1;
    std::uint32_t best = 0;
    for (const auto& [label, number] : held) {
      if (label > 0 && (best == 0 || number > held[best])) best = label;
    }
    if (best == 0) continue;
    const auto number = static_cast<double>(held[best]);
    most[best] = std::max(most[best], held[best]);
    const auto truth = sizes.find(best);
    if (truth == sizes.end()) continue;
    if (number >= kOverlap * static_cast<double>(segment.inliers.size()) &&
        number >= kOverlap * static_cast<double>(truth->second)) {
      score.right += 1;
    }
  }
  for (const auto& [label, size] : sizes) {
    score.true_planes += 1;
    if (static_cast<double>(most[label]) >= kOverlap * static_cast<double>(size)) score.found += 1;
  }
}

void print(const std::string& scene, const char* source, const Score& score) {
  std::printf("| %s | %s | %.3f | %.3f |\n", scene.c_str(), source, score.found / score.true_planes,
              score.segments > 0 ? score.right / score.segments : 0.0);
}

void compare(const std::string& scene, int frames, int features_per_frame) {
  planar_mapping::evaluation::SimulationParams params;
  params.scene = scene;
  params.frames = frames;
  const Simulation simulation(params);
  planar_mapping::evaluation::SimulatedFeatureParams feature_params;
  feature_params.per_frame = features_per_frame;
  planar_mapping::evaluation::SimulatedFeatures features(simulation, feature_params);
  Score metres, disparity, from_features, both;
  for (std::size_t k = 0; k < simulation.size(); ++k) {
    const SimulatedFrame frame = simulation.frame(k);
    const std::vector<KeyFeature> key_features = features.next(frame);
    const PointsView points(frame.xyz.data(), static_cast<std::uint32_t>(params.width),
                            static_cast<std::uint32_t>(params.height), 3);
    std::size_t finite = 0;
    for (std::size_t i = 0; i < points.size; ++i) finite += points.isMeasured(i) ? 1 : 0;
    MultiPlaneParams search;
    search.noise =
        planar_mapping::StereoNoise{params.sensor.baseline, simulation.params().camera().fx, 0.5};
    const std::size_t least = finite / kMinFraction;
    search.min_inliers = static_cast<int>(std::max<std::size_t>(50, least));
    MultiPlaneParams dense = search;
    dense.method = PlaneSearchMethod::Organized;
    const auto run = [&] { return planar_mapping::findPlanes(points, nullptr, dense); };
    const auto run_features = [&] {
      return planar_mapping::segmentPlanes(points, nullptr, key_features, search);
    };
    check(frame, run(), least, metres);
    dense.method = PlaneSearchMethod::Disparity;
    check(frame, run(), least, disparity);
    search.source = planar_mapping::PlaneSource::Features;
    check(frame, run_features(), least, from_features);
    search.source = planar_mapping::PlaneSource::Auto;
    check(frame, run_features(), least, both);
  }
  print(scene, "dense, in metres", metres);
  print(scene, "dense, in disparity space", disparity);
  print(scene, "features", from_features);
  print(scene, "auto: features, then dense", both);
}

}  // namespace

int main(int argc, char** argv) {
  const int frames = argc > 1 ? std::max(1, std::atoi(argv[1])) : 10;
  const int features = argc > 2 ? std::max(1, std::atoi(argv[2])) : 600;
  std::printf("| scene | source | recall | precision |\n");
  std::printf("|---|---|---|---|\n");
  for (const char* scene : {"room", "corridor", "outdoor"}) compare(scene, frames, features);
  return 0;
}
