// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A picture of 20,000 cuboids at 1280 x 720, drawing alone; process start is timed by
// `planar_map_viewer` itself.
#include <benchmark/benchmark.h>

#include "../tests/render/scenes.h"
#include "planar_mapping/viewer/drawing/projection_2d.h"
#include "planar_mapping/viewer/scene/picking.h"
#include "planar_mapping/viewer/window/snapshot.h"

namespace {

using namespace planar_mapping;

void snapshot(benchmark::State& state) {
  const SceneContent content = testing::field(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(renderSnapshot(content, ViewOptions()));
}
BENCHMARK(snapshot)->Arg(500)->Arg(20000)->Arg(200000)->Unit(benchmark::kMillisecond);

void projection(benchmark::State& state) {
  const SceneContent content = testing::field(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(drawProjection2d(content, ViewOptions()));
}
BENCHMARK(projection)->Arg(20000)->Unit(benchmark::kMillisecond);

void pick(benchmark::State& state) {
  const SceneContent content = testing::field(static_cast<int>(state.range(0)));
  const ViewOptions options;
  const CameraView view = placeCamera(content, options);
  const Ray ray = sightLine(view, options.width, options.height, 640.5, 360.5);
  for (auto _ : state) benchmark::DoNotOptimize(pickCuboid(content, ray, view, options));
}
BENCHMARK(pick)->Arg(20000)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
