// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Ground of a 640 x 480 frame: found, followed and labelled; and beliefs of a sparse frame.
#include <benchmark/benchmark.h>

#include "ground_scene.h"
#include "planar_mapping/core/ground/ground.h"
#include "planar_mapping/core/occupancy/kl_occupancy.h"

namespace planar_mapping {
namespace {

/// 640 x 480 points, four floats each as PCL stores them.
std::vector<float> frame(bool ramp) {
  test::GroundScene scene;
  scene.width = 640;
  scene.height = 480;
  scene.focal = 600.0;
  scene.pitch = 0.1;
  scene.wall_distance = 5.0;
  scene.disparity_noise = 0.2;
  if (ramp) scene.ground = [](double x, double) { return 0.1 * std::max(0.0, x - 2.0); };
  scene.render();
  std::vector<float> points;
  for (std::size_t i = 0; i < scene.xyz.size(); i += 3) {
    points.insert(points.end(), {scene.xyz[i], scene.xyz[i + 1], scene.xyz[i + 2], 1.0f});
  }
  return points;
}

void groundOfAFrame(benchmark::State& state) {
  const std::vector<float> points = frame(state.range(0) != 0);
  const PointsView view(points.data(), 640, 480, 4);
  GroundParams params;
  params.camera_height = GroundParams::kPaperCameraHeight;
  params.up = -Vector3::UnitY();
  params.noise = StereoNoise{0.12, 600.0, 0.2};
  for (auto _ : state) {
    const Ground ground = findGround(view, nullptr, params);
    if (!ground.found) state.SkipWithError("no ground");
    benchmark::DoNotOptimize(ground.is_ground.data());
  }
}
BENCHMARK(groundOfAFrame)->ArgName("ramp")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

void beliefsOfFeatures(benchmark::State& state) {
  Random random(1);
  const auto n = static_cast<std::size_t>(state.range(0));
  std::vector<float> xyz;
  std::vector<std::int64_t> tracks;
  for (std::size_t i = 0; i < n; ++i) {
    for (int k = 0; k < 2; ++k) xyz.push_back(static_cast<float>(random.uniform(-2.0, 2.0)));
    xyz.push_back(static_cast<float>(random.uniform(1.0, 6.0)));
    tracks.push_back(static_cast<std::int64_t>(i));
  }
  OccupancyFrame features;
  features.points = PointsView(xyz.data(), n);
  features.tracks = &tracks;
  features.motion = FrameMotion();
  KlOccupancy occupancy;
  std::vector<float> probability;
  for (auto _ : state) occupancy.update(features, probability);
}
BENCHMARK(beliefsOfFeatures)->Arg(1000)->Unit(benchmark::kMillisecond);

void denseProbabilities(benchmark::State& state) {
  const std::vector<float> points = frame(false);
  OccupancyFrame dense;
  dense.points = PointsView(points.data(), 640, 480, 4);
  KlOccupancy occupancy;
  std::vector<float> probability;
  for (auto _ : state) occupancy.update(dense, probability);
}
BENCHMARK(denseProbabilities)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace planar_mapping

BENCHMARK_MAIN();
