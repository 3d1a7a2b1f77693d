// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// What one frame may cost in space: beyond it far space stays undetermined, nothing gets wrong.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <map>
#include <tuple>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/integration/frame.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/map/sensor/depth_image.h"
#include "planar_mapping/map/store/unknown_space.h"

namespace planar_mapping {
namespace {

using detail::SpaceBudget;
using detail::UnknownSpace;

constexpr double kCell = 0.1;

std::vector<float> randomPoints(std::size_t count, double half) {
  Random random(3);
  std::vector<float> xyz(3 * count);
  for (float& value : xyz) value = static_cast<float>(half * (2.0 * random.uniform() - 1.0));
  return xyz;
}

/// Inserts the points as a frame and expects that to take neither minutes nor gigabytes.
void insertQuickly(const std::vector<float>& xyz, PlanarMap& map) {
  FrameObservation observation;
  observation.points = PointsView(xyz.data(), xyz.size() / 3);
  const std::clock_t start = std::clock();
  const FrameUpdate update = map.insert(observation);
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  std::cout << xyz.size() / 3 << " points: " << seconds << " s, " << map.memoryBytes() / 1000000
            << " MB, all space judged up to " << update.space_range << " m\n";
  EXPECT_LT(map.memoryBytes(), 500u << 20u);
#ifndef PLANAR_MAPPING_SANITIZED
  EXPECT_LT(seconds, 20.0);
#endif
}

using Cells = std::map<std::tuple<int, int, int>, std::uint64_t>;

/// Free cells by block.
Cells freeOf(const UnknownSpace& space) {
  Cells cells;
  space.forEachBlock([&](const detail::Int3& at, const UnknownSpace::Block& block) {
    if (block.free != 0) cells[{at.x, at.y, at.z}] = block.free;
  });
  return cells;
}

/// \return the range up to which all was judged
double integrate(const FrameObservation& observation, const SpaceBudget& of_image,
                 UnknownSpace& space) {
  const detail::Frame frame = detail::makeFrame(observation);
  constexpr float kRange = 100.0f;
  double range = std::numeric_limits<double>::infinity();
  for (const detail::DepthImage& image :
       detail::makeDepthImages(observation, frame.rotation, frame.sensor, frame.use, 0.0087,
                               {kRange, 0.0f, 0.0f}, false)) {
    SpaceBudget budget = of_image;
    space.integrate(image, kCell, kRange, budget);
    range = std::min(range, budget.range);
  }
  return range;
}

void expectPartOfAll(const FrameObservation& observation, const SpaceBudget& small) {
  UnknownSpace all;
  UnknownSpace some;
  EXPECT_TRUE(std::isinf(integrate(observation, SpaceBudget(), all)));
  const double range = integrate(observation, small, some);
  ASSERT_TRUE(std::isfinite(range));
  EXPECT_GT(range, 0.5);
  const Cells free_of_all = freeOf(all);
  const Cells free_of_some = freeOf(some);
  EXPECT_LT(free_of_some.size(), free_of_all.size());
  for (const auto& [at, cells] : free_of_some) {
    const auto found = free_of_all.find(at);
    ASSERT_NE(found, free_of_all.end());
    EXPECT_EQ(cells & ~found->second, 0u);
  }
  // Nearer than the range nothing is missing.
  std::size_t near = 0;
  for (const auto& [at, cells] : free_of_all) {
    const Vector3 middle =
        4.0 * kCell * Vector3(std::get<0>(at) + 0.5, std::get<1>(at) + 0.5, std::get<2>(at) + 0.5);
    const Vector3 from = middle - observation.T_world_sensor.translation();
    if (from.norm() > range - 4.0 * kCell) continue;
    ++near;
    const auto found = free_of_some.find(at);
    ASSERT_NE(found, free_of_some.end());
    EXPECT_EQ(found->second, cells);
  }
  EXPECT_GT(near, 0u);
}

TEST(SpaceBudget, OfADenseImageGoesToWhatIsNear) {
  const test::View view = test::look(test::Scene(), test::lookFrom({0.0, -0.5, 1.2}));
  SpaceBudget small;
  small.cubes = 2000;
  expectPartOfAll(view.frame(), small);
}

TEST(SpaceBudget, OfSparseRaysGoesToWhatIsNear) {
  const std::vector<float> xyz = randomPoints(500, 30.0);
  FrameObservation observation;
  observation.points = PointsView(xyz.data(), xyz.size() / 3);
  SpaceBudget few_cells, few_regions;
  few_cells.ray_cells = 10000;
  few_regions.regions = 100;
  for (const SpaceBudget& small : {few_cells, few_regions}) expectPartOfAll(observation, small);
}

TEST(SpaceBudget, PointsBeyondAllThatIsJudgedTakeNoLongerThanNearOnes) {
  for (const Unseen unseen : {Unseen::Unknown, Unseen::Free}) {
    PlanarMapParams params;
    params.unseen = unseen;  // no max_range: as far as is measured, but at most 2,048 cells
    PlanarMap map(params);
    insertQuickly(randomPoints(100, 1e5), map);
  }
}

TEST(SpaceBudget, RandomPointsOfAHugeCubeTakeSecondsAndMegabytes) {
  for (const Unseen unseen : {Unseen::Unknown, Unseen::Free}) {
    for (const std::size_t count : {std::size_t{1000}, std::size_t{4000}}) {
      PlanarMapParams params;
      params.unseen = unseen;
      params.max_range = 200.0;
      PlanarMap map(params);
      insertQuickly(randomPoints(count, 200.0), map);
      EXPECT_FALSE(map.serialize().empty());
    }
  }
}

}  // namespace
}  // namespace planar_mapping
