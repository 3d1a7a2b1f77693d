// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Space that is free unless something hides it: the paper's reading, Unseen::Free.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <tuple>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

using namespace test;

PlanarMapParams paramsAt(double resolution, double max_range = 8.0) {
  PlanarMapParams params;
  params.approximation.resolution = resolution;
  params.max_range = max_range;
  params.unseen = Unseen::Free;
  return params;
}

/// Is the straight line from the sensor to the point free of the scene's surfaces?
bool isVisible(const Scene& scene, const Vector3& sensor, const Vector3& point) {
  return castRay(scene, sensor, point - sensor).t >= 1.0;
}

/// All 27 of a grid over the cell and its rim of half a cell.
template <typename Predicate>
bool allAround(const Vector3& centre, double cell, Predicate&& predicate) {
  for (int i = -1; i <= 1; ++i) {
    for (int j = -1; j <= 1; ++j) {
      for (int k = -1; k <= 1; ++k) {
        if (!predicate(Vector3(centre + cell * Vector3(i, j, k)))) return false;
      }
    }
  }
  return true;
}

TEST(UnknownSpace, IsWhatLiesBehindAndNeverWhatIsSeen) {
  const Scene scene;
  const Vector3 sensor(0.0, -0.5, 1.2);
  const View view = look(scene, lookFrom(sensor));
  PlanarMap map(paramsAt(0.1));
  map.insert(view.frame());
  std::size_t hidden = 0, unknown = 0, seen = 0;
  for (double x = -1.95; x < 2.0; x += 0.1) {
    for (double y = -0.45; y < 4.9; y += 0.1) {
      for (double z = 0.05; z < 2.6; z += 0.1) {
        const Vector3 p(x, y, z);
        const Vector3 c = view.pose.inverse() * p;
        const double column = 250.0 * c.x() / c.z() + 159.5;
        const double row = 250.0 * c.y() / c.z() + 119.5;
        const bool in_view = c.z() > 0.5 && column > 20 && column < 300 && row > 20 && row < 220;
        if (!in_view || map.isOccupied(p)) continue;
        if (allAround(p, 0.1, [&](const Vector3& q) { return isVisible(scene, sensor, q); })) {
          EXPECT_TRUE(map.isFree(p)) << p.transpose();
          ++seen;
        }
        if (allAround(p, 0.2, [&](const Vector3& q) { return !isVisible(scene, sensor, q); })) {
          ++hidden;
          unknown += map.isUnknown(p);
        }
      }
    }
  }
  EXPECT_GT(seen, 5000u);
  EXPECT_GT(hidden, 200u);
  EXPECT_GE(unknown, hidden * 98 / 100);
}

TEST(UnknownSpace, DoesNotDependOnTheNumberOfThreads) {
  const auto bytesWith = [](int threads) {
    PlanarMapParams params = paramsAt(0.1);
    params.approximation.threads = threads;
    PlanarMap map(params);
    for (int i = 0; i < 4; ++i)
      map.insert(look(Scene(), lookFrom({-1.0 + 0.6 * i, -0.3, 1.0}, 0.15 * i - 0.2)).frame());
    EXPECT_GT(map.unknownCells(), 0u);
    return map.serialize();
  };
  EXPECT_EQ(bytesWith(1), bytesWith(2));
  EXPECT_EQ(bytesWith(1), bytesWith(0));
}

TEST(UnknownSpace, DoesNotDependOnTheOrderOfFrames) {
  std::vector<View> views;
  for (int i = 0; i < 4; ++i)
    views.push_back(look(Scene(), lookFrom({-1.0 + 0.6 * i, -0.3, 1.0}, 0.15 * i - 0.2)));
  // Without planes: then nothing but the space itself is compared.
  const auto unknownOf = [&](const std::vector<int>& order) {
    PlanarMap map(paramsAt(0.1));
    for (const int i : order) {
      FrameObservation frame = views[static_cast<std::size_t>(i)].frame();
      const Indices nothing;
      frame.planes = nullptr;
      frame.indices = &nothing;
      map.insert(frame);
    }
    std::vector<std::tuple<double, double, double>> boxes;
    for (const Cuboid& c : map.unknownCuboids())
      boxes.emplace_back(c.center.x(), c.center.y(), c.center.z());
    return std::make_pair(map.unknownCells(), boxes);
  };
  const auto expected = unknownOf({0, 1, 2, 3});
  EXPECT_GT(expected.first, 1000u);
  EXPECT_EQ(unknownOf({3, 2, 1, 0}), expected);
  EXPECT_EQ(unknownOf({2, 0, 3, 1}), expected);
  EXPECT_EQ(unknownOf({2, 0, 2, 3, 3, 1, 0}), expected);
}

TEST(UnknownSpace, IsCoveredExactlyByItsCuboids) {
  PlanarMap map(paramsAt(0.1));
  map.insert(look(Scene(), lookFrom({0.0, 0.0, 1.0})).frame());
  const std::vector<Cuboid> boxes = map.unknownCuboids();
  double volume = 0.0;
  for (const Cuboid& c : boxes) {
    volume += c.volume();
    EXPECT_EQ(c.state, CellState::Unknown);
    EXPECT_EQ(c.plane_id, -1);
    EXPECT_FALSE(map.isFree(c.center));
  }
  EXPECT_NEAR(volume, 1e-3 * static_cast<double>(map.unknownCells()), 1e-6 * volume);
  EXPECT_LT(boxes.size() * 20, map.unknownCells());
}

TEST(UnknownSpace, CanBeSwitchedOffAndHasAResolutionOfItsOwn) {
  const View view = look(Scene(), lookFrom({0.0, 0.0, 1.0}));
  PlanarMapParams params = paramsAt(0.1);
  params.unknown_space = false;
  PlanarMap off(params);
  off.insert(view.frame());
  EXPECT_EQ(off.unknownCells(), 0u);
  EXPECT_TRUE(off.unknownCuboids().empty());
  params.unknown_space = true;
  params.unknown_resolution = 0.2;
  PlanarMap coarse(params);
  coarse.insert(view.frame());
  PlanarMap fine(paramsAt(0.1));
  fine.insert(view.frame());
  EXPECT_GT(coarse.unknownCells(), 0u);
  EXPECT_LT(coarse.unknownCells(), fine.unknownCells() / 5);
}

TEST(UnknownSpace, EndsAtTheMaximumRange) {
  PlanarMap map(paramsAt(0.1, 6.0));
  const View view = look(Scene(), lookFrom({0.0, 0.0, 1.2}, 0.0, 0.0));
  map.insert(view.frame());
  for (const Cuboid& c : map.unknownCuboids()) {
    for (const Vector3& corner : corners(c)) EXPECT_LE(corner.y(), 6.11);
  }
  EXPECT_TRUE(map.isUnknown({0.0, 5.5, 1.2}));
  EXPECT_TRUE(map.isFree({0.0, 6.5, 1.2}));
}

TEST(UnknownSpace, LearnsNothingFromPixelsWithoutAMeasurement) {
  View view = look(Scene(), lookFrom({0.0, 0.0, 1.0}));
  std::fill(view.xyz.begin(), view.xyz.end(), std::numeric_limits<float>::quiet_NaN());
  view.planes.clear();
  PlanarMap map(paramsAt(0.1));
  map.insert(view.frame());
  EXPECT_EQ(map.unknownCells(), 0u);
  EXPECT_TRUE(map.empty());
}

TEST(UnknownSpace, IsClearedByGroundThatIsNotMapped) {
  // The only thing seen is the floor, given as ground: space above it is free, below unknown.
  Scene scene;
  scene.boxes = {{{-50.0, -50.0, -1.0}, {50.0, 50.0, 0.0}, false, false}};
  const View view = look(scene, lookFrom({0.0, 0.0, 1.0}, 0.0, 0.6));
  Indices ground;
  for (std::size_t i = 0; i < view.xyz.size() / 3; ++i) ground.push_back(static_cast<int>(i));
  FrameObservation frame = view.frame();
  frame.ground = &ground;
  PlanarMap map(paramsAt(0.1));
  map.insert(frame);
  EXPECT_TRUE(map.cuboids().empty());
  EXPECT_TRUE(map.isFree({0.0, 1.5, 0.15}));
  EXPECT_TRUE(map.isUnknown({0.0, 1.6, -0.45}));
}

TEST(UnknownSpace, IsTheSameWithTheCameraGivenOrFound) {
  const View view = look(Scene(), lookFrom({0.1, 0.0, 1.0}, 0.2));
  PlanarMap given(paramsAt(0.1));
  PlanarMap found(paramsAt(0.1));
  FrameObservation frame = view.frame();
  given.insert(frame);
  frame.camera.reset();
  found.insert(frame);
  EXPECT_NEAR(static_cast<double>(found.unknownCells()), static_cast<double>(given.unknownCells()),
              0.01 * static_cast<double>(given.unknownCells()));
}

TEST(UnknownSpace, IsFoundFromAnUnorganizedCloud) {
  const Scene scene;
  const Vector3 sensor(0.0, -0.5, 1.2);
  const View view = look(scene, lookFrom(sensor));
  FrameObservation frame = view.frame();
  frame.points = PointsView(view.xyz.data(), view.xyz.size() / 3);
  frame.camera.reset();
  PlanarMap map(paramsAt(0.1));
  map.insert(frame);
  PlanarMap organized(paramsAt(0.1));
  organized.insert(view.frame());
  std::size_t both = 0, wrong = 0, expected = 0;
  for (double x = -1.5; x < 1.5; x += 0.1) {
    for (double y = 0.5; y < 6.0; y += 0.1) {
      for (double z = 0.3; z < 2.0; z += 0.1) {
        const Vector3 p(x, y, z);
        expected += organized.isUnknown(p);
        both += organized.isUnknown(p) && map.isUnknown(p);
        wrong += map.isUnknown(p) &&
                 allAround(p, 0.1, [&](const Vector3& q) { return isVisible(scene, sensor, q); });
      }
    }
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_GT(both, expected * 8 / 10);
}

/// A box in front of a wall, seen along +y from two places. All numbers by hand: the wall is
/// y = 4, the box fills [-0.5, 0.5] x [2, 2.5] and is as high as the picture.
struct BoxAndWall {
  Scene scene;
  BoxAndWall() {
    scene.boxes = {{{-8.0, -1.0, -8.0}, {8.0, 4.0, 8.0}, true, true},
                   {{-0.5, 2.0, -5.0}, {0.5, 2.5, 5.0}, false, true}};
  }
  View from(double x) const { return look(scene, lookFrom({x, 0.0, 0.0}, 0.0, 0.0)); }
};

TEST(UnknownSpace, IsTheShadowOfABoxAsComputedByHand) {
  const BoxAndWall world;
  PlanarMap map(paramsAt(0.1));
  map.insert(world.from(0.0).frame());
  // From x = 0 the front edges (+-0.5, 2) cast the shadow |x| < y / 4: at y = 3 that is 0.75.
  EXPECT_TRUE(map.isUnknown({0.0, 3.05, 0.05}));
  EXPECT_TRUE(map.isUnknown({0.55, 3.05, 0.05}));
  EXPECT_TRUE(map.isUnknown({-0.55, 3.05, 0.05}));
  EXPECT_TRUE(map.isFree({0.95, 3.05, 0.05}));
  EXPECT_TRUE(map.isFree({-0.95, 3.05, 0.05}));
  EXPECT_TRUE(map.isFree({0.0, 1.05, 0.05}));      // in front of the box
  EXPECT_TRUE(map.isUnknown({0.75, 3.55, 0.05}));  // 0.89 there
  EXPECT_TRUE(map.isUnknown({1.55, 4.45, 0.05}));  // behind the wall
  EXPECT_TRUE(map.isFree({3.55, 3.05, 0.05}));     // beside the picture: never judged
}

TEST(UnknownSpace, OfTwoPosesIsWhatNeitherSawFree) {
  const BoxAndWall world;
  PlanarMap left(paramsAt(0.1));
  PlanarMap right(paramsAt(0.1));
  const View first = world.from(-1.0);
  const View second = world.from(1.0);
  left.insert(first.frame());
  left.insert(second.frame());
  right.insert(second.frame());
  right.insert(first.frame());
  for (const PlanarMap* map : {&left, &right}) {  // in whatever order
    // From x = -1 the shadow lies between the lines through (-0.5, 2.5), whose slope is 0.5 / 2.5,
    // and (0.5, 2), slope 1.5 / 2: at y = 3 from -1 + 0.6 = -0.4 to -1 + 2.25 = 1.25. From x = 1 it
    // is the mirror image, so that only |x| < 0.4 stays unknown; at y = 3.5, |x| < 0.3.
    EXPECT_TRUE(map->isUnknown({0.05, 3.05, 0.05}));
    EXPECT_TRUE(map->isUnknown({0.15, 3.05, 0.05}));
    EXPECT_TRUE(map->isUnknown({-0.15, 3.05, 0.05}));
    EXPECT_TRUE(map->isUnknown({0.05, 3.45, 0.05}));
    for (const double x : {0.65, 0.85, 1.05, -0.65, -0.85, -1.05})
      EXPECT_TRUE(map->isFree({x, 3.05, 0.05})) << x;
    EXPECT_TRUE(map->isFree({0.55, 3.55, 0.05}));
    EXPECT_TRUE(map->isUnknown({0.05, 4.55, 0.05}));  // behind the wall
  }
  EXPECT_EQ(left.unknownCells(), right.unknownCells());
}

}  // namespace
}  // namespace planar_mapping
