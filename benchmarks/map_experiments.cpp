// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Figures of docs/results.md: map_experiments [outliers | rest | corridor]
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <vector>

#include "occupancy_experiment.h"

namespace {

using namespace planar_mapping;
using test::Scene;
using test::StereoErrors;
using test::View;

/// Beliefs as the stage kl_occupancy gives them to clouds without key features.
class Beliefs {
 public:
  explicit Beliefs(const StereoErrors& errors, double focal_length) {
    KlOccupancyParams params;
    params.beliefs.occupancy.noise = {errors.baseline, focal_length, 0.5};
    occupancy_.setParams(params);
  }
  const std::vector<float>& of(const View& view) {
    const std::size_t n = view.xyz.size() / 3;
    Indices indices;
    std::vector<std::int32_t> labels(n, -1);
    for (std::size_t k = 0; k < view.planes.size(); ++k) {
      for (const int i : view.planes[k].inliers)
        labels[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(k);
    }
    for (std::size_t i = 0; i < n; ++i) {
      if (std::isfinite(view.xyz[3 * i])) indices.push_back(static_cast<int>(i));
    }
    OccupancyFrame frame;
    frame.points = PointsView(view.xyz.data(), n);
    frame.indices = &indices;
    frame.plane_labels = &labels;
    frame.T_world_sensor = view.pose;
    occupancy_.update(frame, probability_);
    return probability_;
  }

 private:
  KlOccupancy occupancy_;
  std::vector<float> probability_;
};

void printOutliers() {
  std::printf("%-6s %-6s %-14s %8s %8s %8s %8s\n", "wrong", "miss", "update", "wrong", "occupied",
              "error%", "complete");
  for (const double wrong : {0.0, 0.05, 0.10, 0.20}) {
    for (const double miss : {1.0, 0.7}) {
      for (const test::Variant& variant : test::variants()) {
        const test::OutlierResult r = test::runOutliers(wrong, miss, variant);
        std::printf("%-6.2f %-6.1f %-14s %8zu %8zu %8.2f %8.3f\n", wrong, miss, variant.name,
                    r.wrong, r.occupied,
                    100.0 * static_cast<double>(r.wrong) / static_cast<double>(r.occupied),
                    r.completeness);
      }
    }
  }
}

void printRest() {
  for (const double noise : {0.0, 0.25, 0.5}) {
    for (const bool believed : {false, true}) {
      Scene scene;
      scene.camera = {500.0, 500.0, 319.5, 239.5, 640, 480};
      StereoErrors errors;
      errors.noise_px = noise;
      Random random(3);
      PlanarMapParams params;
      params.max_range = 8.0;
      params.unknown_space = false;
      PlanarMap map(params);
      Beliefs beliefs(errors, 500.0);
      std::printf("noise %.2f px beliefs %d:", noise, believed);
      std::size_t first_bytes = 0;
      const int frames = 100;
      for (int i = 0; i < frames; ++i) {
        const View view = test::lookNoisy(scene, test::lookFrom({0, 0, 1.0}), errors, random, 1000);
        FrameObservation frame = view.frame();
        frame.noise = StereoNoise{errors.baseline, view.camera.fx, 0.5};
        if (believed) frame.probability = &beliefs.of(view);
        map.insert(frame);
        if (i == 0) first_bytes = map.memoryBytes();
        if (i == 0 || i == 9 || i == 49 || i == 99) {
          const auto e = test::mappingError(map, Scene(), 0.1);
          std::printf("  [%d] cuboids %zu cells %.0f wrong %zu mem %.2f file %zu planes %zu", i + 1,
                      map.cuboids().size(), test::volumeInCells(map, 0.1), e.wrong,
                      static_cast<double>(map.memoryBytes()) / static_cast<double>(first_bytes),
                      map.serialize().size(), map.planes().size());
        }
      }
      std::printf("\n");
    }
  }
}

void printCorridor() {
  Scene scene = test::corridor(100.0);
  scene.camera = {120.0, 120.0, 79.5, 59.5, 160, 120};
  for (const double noise : {0.0, 0.1}) {
    StereoErrors errors;
    errors.noise_px = noise;
    Random random(3);
    PlanarMapParams params;
    params.max_range = 8.0;
    params.unknown_space = false;
    PlanarMap map(params);
    Beliefs beliefs(errors, scene.camera.fx);
    std::vector<double> ms;
    for (int i = 0; i < 1000; ++i) {
      View view = test::look(scene, test::lookFrom({0.0, 0.5 + 0.095 * i, 0.7}), 0.2 * i);
      test::addStereoErrors(view, errors, random);
      view.planes.erase(
          std::remove_if(view.planes.begin(), view.planes.end(),
                         [](const PlaneSegment& p) { return p.inliers.size() < 100; }),
          view.planes.end());
      Indices near;  // as the stage depth_error_limit leaves them
      for (std::size_t k = 0; k < view.xyz.size() / 3; ++k) {
        if (view.xyz[3 * k + 2] < 4.0f) near.push_back(static_cast<int>(k));
      }
      FrameObservation frame = view.frame();
      frame.noise = StereoNoise{errors.baseline, view.camera.fx, 0.5};
      frame.indices = &near;
      frame.probability = &beliefs.of(view);
      const std::clock_t start = std::clock();
      map.insert(frame);
      ms.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
      if (i % 333 == 332 || i == 999) {
        std::printf("noise %.2f frame %d: planes %zu cuboids %zu memory %zu file %zu\n", noise,
                    i + 1, map.planes().size(), map.cuboids().size(), map.memoryBytes(),
                    map.serialize().size());
      }
    }
    std::vector<double> early(ms.begin() + 100, ms.begin() + 200), late(ms.end() - 100, ms.end());
    std::sort(early.begin(), early.end());
    std::sort(late.begin(), late.end());
    std::printf("median ms frames 100-200 %.3f last 100 %.3f\n", early[50], late[50]);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto wanted = [&](const char* name) { return argc < 2 || std::strcmp(argv[1], name) == 0; };
  if (wanted("outliers")) printOutliers();
  if (wanted("rest")) printRest();
  if (wanted("corridor")) printCorridor();
  return 0;
}
