// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include "depth_scene.h"
#include "planar_mapping/core/planes/multi_plane.h"

namespace {

using planar_mapping::Vector3;

/// A room corner with a table, boxes and a ball, 640 x 480.
planar_mapping::test::DepthScene furnishedRoom() {
  planar_mapping::test::DepthScene scene(640, 480, 525.0);
  scene.addRectangle({0.0, 1.2, 3.0}, {4.0, 0.0, 0.0}, {0.0, 0.0, 3.0});
  scene.addRectangle({-2.0, 0.0, 3.0}, {0.0, 1.2, 0.0}, {0.0, 0.0, 3.0});
  scene.addRectangle({1.0, 0.0, 5.0}, {3.0, 0.0, 0.8}, {0.0, 1.5, 0.0});
  scene.addRectangle({0.4, 0.5, 2.5}, {0.7, 0.0, 0.0}, {0.0, 0.0, 0.5});
  scene.addRectangle({0.3, 0.3, 2.4}, {0.2, 0.0, 0.05}, {0.0, 0.2, 0.0});
  scene.addRectangle({-1.0, 0.6, 3.2}, {0.3, 0.0, -0.2}, {0.0, 0.6, 0.0});
  scene.addBall({-0.7, 0.9, 2.2}, 0.3);
  return scene;
}

void organizedPlanes(benchmark::State& state) {
  planar_mapping::test::DepthScene scene = furnishedRoom();
  scene.render(0.0015, 0.05, 1);
  scene.addFlyingPixels(2);
  planar_mapping::MultiPlaneParams params;
  params.method = planar_mapping::PlaneSearchMethod::Organized;
  params.min_inliers = 1000;
  params.threads = static_cast<int>(state.range(0));
  std::size_t planes = 0;
  for (auto _ : state) {
    const planar_mapping::PlaneSet set = planar_mapping::findPlanes(scene.view(), nullptr, params);
    planes = set.planes.size();
    benchmark::DoNotOptimize(planes);
  }
  state.counters["planes"] = static_cast<double>(planes);
}
BENCHMARK(organizedPlanes)->ArgName("threads")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
