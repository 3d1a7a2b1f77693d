// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Plans of a floor of 40 x 15 m and of a building of 100 x 100 m, in cells of 0.1 m, and queries.
#include <benchmark/benchmark.h>

#include "plan_scene.h"
#include "planar_mapping/plan/plan.h"

namespace planar_mapping {
namespace {

constexpr double kLength = 40.0, kWidth = 15.0;  // of the floor, metres

/// A corridor between rooms with doorways and tables, scanned from places 1.5 m apart.
const PlanarMap& floorMap() {
  static const PlanarMap map = [] {
    test::PlanScene scene;
    scene.rings = 32;
    scene.sensor = 0.8;
    scene.add({0, 0, -1}, {kLength, kWidth, 0}).add({0, 0, 2.5}, {kLength, kWidth, 2.7});
    for (const double y : {0.0, kWidth - 0.2}) scene.add({0, y, 0}, {kLength, y + 0.2, 2.5});
    for (const double x : {0.0, kLength - 0.2}) scene.add({x, 0, 0}, {x + 0.2, kWidth, 2.5});
    for (double x = 0.0; x < kLength; x += 5.0) {
      for (const double y : {6.0, 8.8}) {  // the corridor lies between; a doorway in each wall
        scene.add({x, y, 0}, {x + 2.0, y + 0.2, 2.5}).add({x + 3.0, y, 0}, {x + 5.0, y + 0.2, 2.5});
      }
      scene.add({x, 0, 0}, {x + 0.1, 6, 2.5}).add({x, 9, 0}, {x + 0.1, kWidth, 2.5});
      scene.add({x + 0.5, 1, 0.7}, {x + 2.0, 2, 0.75}).add({x + 3, 12, 0}, {x + 4, 13, 0.8});
    }
    for (double x = 2.5; x < kLength; x += 1.25) scene.places.push_back({x, 7.5, 0});
    for (double x = 2.5; x < kLength; x += 5.0) {
      scene.places.push_back({x, 3.5, 0});
      scene.places.push_back({x, 11.0, 0});
    }
    return scene.map();
  }();
  return map;
}

/// What a map knows, as cuboids: the same for any robot.
void sourceOfAFloor(benchmark::State& state) {
  const PlanarMap& map = floorMap();
  for (auto _ : state) benchmark::DoNotOptimize(planSourceOf(map));
}
BENCHMARK(sourceOfAFloor)->Unit(benchmark::kMillisecond);

void floorOf40By15Metres(benchmark::State& state) {
  const PlanSource source = planSourceOf(floorMap());
  double free = 0.0;
  for (auto _ : state) free = plansOf(source, RobotModel()).at(0).freeFraction();
  state.counters["free"] = free;
}
BENCHMARK(floorOf40By15Metres)->Unit(benchmark::kMillisecond);

void buildingOf100By100Metres(benchmark::State& state) {
  const PlanSource one = planSourceOf(floorMap());
  PlanSource all = one;
  for (int row = 0; row < 7; ++row) {
    for (int column = row == 0 ? 1 : 0; column < 3; ++column) {
      const Vector3 off(kLength * column, kWidth * row, 0.0);
      const auto copy = [&](const auto& from, auto& to, auto moved) {
        for (auto entry : from) {
          moved(entry) += off;
          to.push_back(entry);
        }
      };
      const auto center = [](Cuboid& c) -> Vector3& { return c.center; };
      copy(one.occupied, all.occupied, center);
      copy(one.space, all.space, center);
      copy(one.floors, all.floors, [](MeasuredCells& f) -> Vector3& { return f.origin; });
      copy(one.path, all.path, [](Vector3& p) -> Vector3& { return p; });
    }
  }
  std::size_t cells = 0;
  for (auto _ : state) cells = plansOf(all, RobotModel()).at(0).values.size();
  state.counters["m2"] = 0.01 * double(cells);
}
BENCHMARK(buildingOf100By100Metres)->Unit(benchmark::kMillisecond);

void isStandable(benchmark::State& state) {
  const Plan plan = plansOf(floorMap()).at(0);
  double x = 0.0;
  for (auto _ : state) {
    x = x < kLength ? x + 0.37 : 0.0;
    benchmark::DoNotOptimize(plan.isStandable(x, 7.5));
  }
}
BENCHMARK(isStandable);

void distances(benchmark::State& state) {
  const Plan plan = plansOf(floorMap()).at(0);
  for (auto _ : state) benchmark::DoNotOptimize(plan.distances());
}
BENCHMARK(distances)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace planar_mapping

BENCHMARK_MAIN();
