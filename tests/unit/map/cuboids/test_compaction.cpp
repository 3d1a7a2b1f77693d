// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The cuboids of a map depend on its cells alone: not on how often they were asked for while it
// grew, nor on who made them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <vector>

#include "evaluation/metrics/cuboid_geometry.h"
#include "noisy_sequence.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

using test::numbersOf;

enum class Asked : std::uint8_t { Never, Quickly, Fully, InTurn };

/// A map of a noisy walk; its cuboids are counted after each frame.
PlanarMap walked(const std::vector<test::View>& views, int threads, Asked asked) {
  PlanarMapParams params;
  params.approximation.threads = threads;
  PlanarMap map(params);
  for (const test::View& view : views) {
    FrameObservation frame = view.frame();
    frame.noise = StereoNoise{0.25, view.camera.fx, 0.5};
    map.insert(frame);
    const bool in_turn = asked == Asked::InTurn && map.frames() % 3 != 0;
    if (asked == Asked::Quickly || in_turn) {
      EXPECT_GT(map.cuboidCountAtMost(), 0u);
    }
    if (asked == Asked::Fully || (in_turn && map.frames() % 3 == 1)) {
      EXPECT_GT(map.cuboidCount(), 0u);
    }
  }
  EXPECT_EQ(map.cuboidCount(), map.cuboids().size());
  return map;
}

TEST(Compaction, DoesNotDependOnTheNumberOfThreads) {
  const std::vector<test::View> views = test::noisyWalk({0, 1, 2, 3, 4, 5});
  const std::vector<double> one = numbersOf(walked(views, 1, Asked::Fully).cuboids());
  ASSERT_GT(one.size(), 30u * 12u);
  EXPECT_EQ(one, numbersOf(walked(views, 2, Asked::Fully).cuboids()));
  EXPECT_EQ(one, numbersOf(walked(views, 7, Asked::Fully).cuboids()));
  EXPECT_EQ(one, numbersOf(walked(views, 2, Asked::Quickly).cuboids()));
}

TEST(Compaction, DoesNotDependOnHowOftenCuboidsWereAskedFor) {
  const std::vector<test::View> views = test::noisyWalk({0, 1, 2, 3, 4, 5, 6});
  const std::vector<double> never = numbersOf(walked(views, 2, Asked::Never).cuboids());
  EXPECT_EQ(numbersOf(walked(views, 2, Asked::Fully).cuboids()), never);
  EXPECT_EQ(numbersOf(walked(views, 2, Asked::Quickly).cuboids()), never);
  EXPECT_EQ(numbersOf(walked(views, 2, Asked::InTurn).cuboids()), never);
}

TEST(Compaction, AQuickCountIsNeverLessAndSettlesWhereNothingChanges) {
  std::size_t more = 0;
  PlanarMap map;
  for (const test::View& view : test::noisyWalk({0, 1, 2, 3, 4, 5})) {
    FrameObservation frame = view.frame();
    frame.noise = StereoNoise{0.25, view.camera.fx, 0.5};
    map.insert(frame);
    const PlanarMap fresh = map;  // has counted nothing yet
    const std::size_t at_most = map.cuboidCountAtMost();
    EXPECT_EQ(map.cuboidCountAtMost(), at_most);
    EXPECT_GE(at_most, fresh.cuboidCount());
    more += at_most - fresh.cuboidCount();
  }
  EXPECT_GT(more, 0u);
  // Once all is covered fully, a frame far away changes nothing here but what is joined.
  ASSERT_EQ(map.cuboidCount(), map.cuboids().size());
  Pose away = Pose::Identity();
  away.translation() = Vector3(500.0, 0.0, 0.0);
  std::vector<float> xyz{0.0f, 0.0f, 5.0f};
  FrameObservation frame;
  frame.points = PointsView(xyz.data(), 1);
  frame.T_world_sensor = away;
  map.insert(frame);
  const std::size_t at_most = map.cuboidCountAtMost();
  EXPECT_GE(at_most, map.cuboidCount());
  EXPECT_EQ(map.cuboidCount(), map.cuboids().size());
  // A frame without a point changes nothing at all.
  frame.points = PointsView(xyz.data(), 0);
  map.insert(frame);
  const std::size_t settled = map.cuboidCountAtMost();
  EXPECT_EQ(settled, map.cuboidCount());
  EXPECT_EQ(settled, map.cuboids().size());
}

TEST(Compaction, ABoxOnAPlaneHasItsNumber) {
  const PlanarMap map = walked(test::noisyWalk({0, 1, 2, 3, 4, 5}), 1, Asked::Never);
  const double s = map.params().approximation.resolution;
  std::size_t boxes = 0;
  for (const Cuboid& c : map.cuboids()) {
    if (c.plane_id < 0) continue;
    const auto plane = std::find_if(map.planes().begin(), map.planes().end(),
                                    [&](const MapPlane& p) { return p.id == c.plane_id; });
    ASSERT_NE(plane, map.planes().end());
    const Vector3 n = c.orientation * Vector3::UnitZ();
    EXPECT_GE(n.dot(plane->plane.normal), std::cos(map.params().association_angle) - 1e-9);
    EXPECT_LE(std::abs(plane->plane.signedDistance(c.center)), 1.5 * s + 1e-9);
    EXPECT_LE(c.size.z(), 2.0 * s * (1.0 + 1e-9));
    // Boxes have the axes of the world; rasters are those of planes that noise has turned.
    const Matrix3 axes = c.orientation.toRotationMatrix().cwiseAbs();
    boxes += (axes - axes.array().round().matrix()).cwiseAbs().maxCoeff() < 1e-12 ? 1 : 0;
  }
  EXPECT_GT(boxes, 0u);
  EXPECT_LT(boxes, map.cuboids().size());
}

/// Random points in a cube of 6.4 m around the origin.
std::vector<float> clutter(std::size_t count) {
  Random random(5);
  std::vector<float> xyz(3 * count);
  for (float& value : xyz) value = static_cast<float>(6.4 * random.uniform() - 3.2);
  return xyz;
}

TEST(Compaction, ClutterIsCoveredWithoutASearchAndCompletely) {
  const std::vector<float> xyz = clutter(60000);
  PlanarMapParams params;
  params.unknown_space = false;
  PlanarMap map(params);
  FrameObservation frame;
  frame.points = PointsView(xyz.data(), xyz.size() / 3);
  map.insert(frame);
  EXPECT_EQ(map.clutteredRegions(), 1u);
  EXPECT_EQ(map.cuboidCountAtMost(), map.cuboidCount());
  std::set<std::array<int, 3>> cells;
  for (std::size_t i = 0; i < frame.points.size; ++i) {
    const Vector3 cell = (frame.points.point(i) / params.approximation.resolution).array().floor();
    cells.insert(
        {static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z())});
  }
  EXPECT_LT(2 * map.cuboidCount(), cells.size());
  for (std::size_t i = 0; i < frame.points.size; ++i) {
    const Vector3 p = frame.points.point(i);
    ASSERT_FALSE(map.cuboidsAt(p, 0.5 * params.approximation.resolution + 1e-6).empty());
  }
  const std::vector<std::uint8_t> bytes = map.serialize();
  const PlanarMap again = PlanarMap::deserialize(bytes.data(), bytes.size());
  EXPECT_EQ(again.clutteredRegions(), 1u);
  EXPECT_EQ(numbersOf(again.cuboids()), numbersOf(map.cuboids()));
  EXPECT_EQ(map.finished().clutteredRegions(), 0u);
  // Furniture and walls are far from it.
  EXPECT_EQ(walked(test::noisyWalk({0, 1}), 1, Asked::Fully).clutteredRegions(), 0u);
}

}  // namespace
}  // namespace planar_mapping
