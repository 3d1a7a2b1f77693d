// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <algorithm>

#include "planar_mapping/core/planes/multi_plane.h"
#include "plane_scenes.h"

// Plane search on generated rooms; plane_bench_plugin.cpp offers the same searches to plane_bench,
// which times other libraries beside them. Counters are the quality of the last result.
namespace {

using planar_mapping::MultiPlaneParams;
using planar_mapping::PlaneSet;
using planar_mapping::test::makeRoom;
using planar_mapping::test::PlaneScene;
using planar_mapping::test::PlaneScore;
using planar_mapping::test::RoomKind;

void search(benchmark::State& state, const PlaneScene& scene) {
  MultiPlaneParams params;
  params.min_inliers = std::max(20, static_cast<int>(scene.size() / 300));
  PlaneSet found;
  for (auto _ : state) {
    found = findPlanes(scene.view(), nullptr, params);
    benchmark::DoNotOptimize(found.planes.data());
  }
  const PlaneScore score = scorePlanes(scene, found);
  state.counters["recall"] = score.recall;
  state.counters["precision"] = score.precision;
  state.counters["angle_deg"] = score.angle_deg;
  state.counters["point_recall"] = score.point_recall;
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(scene.size()));
}

/// Points on planes; 30 % of all points are outliers.
void unorganizedRoom(benchmark::State& state) {
  search(state,
         makeRoom(static_cast<std::size_t>(state.range(0)), 0.3, 0.0015, 1, RoomKind::Dense));
}
BENCHMARK(unorganizedRoom)
    ->Arg(21000)
    ->Arg(210000)
    ->Arg(2100000)
    ->Arg(7000000)
    ->Unit(benchmark::kMillisecond);

void sparseFeatures(benchmark::State& state) {
  search(state, makeRoom(600, 0.3, 0.0015, 1, RoomKind::Features));
}
BENCHMARK(sparseFeatures)->Unit(benchmark::kMillisecond);

void sparseFeaturesMostlyOutliers(benchmark::State& state) {
  search(state, makeRoom(600, 0.6, 0.002, 1, RoomKind::UnevenFeatures));
}
BENCHMARK(sparseFeaturesMostlyOutliers)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
