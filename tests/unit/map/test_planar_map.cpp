// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/planar_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "map_scene.h"
#include "map_walk.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping {
namespace {

using namespace test;

/// Of the beliefs that a map keeps.
constexpr double kBeliefStep = 1.0 / 17.0;

bool sameCuboid(const Cuboid& a, const Cuboid& b) {
  const double turn = std::abs(a.orientation.coeffs().dot(b.orientation.coeffs()));
  return (a.center - b.center).norm() < 3e-4 && (a.size - b.size).norm() < 1e-6 &&
         turn > 1.0 - 1e-9 && a.plane_id == b.plane_id &&
         std::abs(a.probability - b.probability) < 0.5 * kBeliefStep + 1e-6;
}

TEST(PlanarMap, IsEmptyAndUnknownBeforeAnything) {
  const PlanarMap map;
  Vector3 low, high;
  EXPECT_TRUE(map.empty());
  EXPECT_EQ(map.frames(), 0u);
  EXPECT_FALSE(map.bounds(low, high));
  EXPECT_TRUE(map.isUnknown({1.0, 2.0, 3.0}));
  EXPECT_EQ(map.occupancyAt({0.0, 0.0, 0.0}), 0.5);
  EXPECT_TRUE(map.unknownCuboids().empty());
}

TEST(PlanarMap, ChangesOnlyBeliefsWhenTheSameFrameComesAgain) {
  PlanarMap map(paramsAt(0.1));
  const View view = look(Scene(), lookFrom({0.0, 0.0, 1.0}));
  map.insert(view.frame());
  const std::vector<Cuboid> before = map.cuboids();
  const FrameUpdate update = map.insert(view.frame());
  EXPECT_EQ(update.planes_new, 0u);
  EXPECT_EQ(update.patches_rebuilt, 1u);  // the non-planar cells, which are confirmed
  EXPECT_EQ(update.cells_added, 0u);
  EXPECT_EQ(update.cells_removed, 0u);
  ASSERT_EQ(map.cuboids().size(), before.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    Cuboid now = map.cuboids()[i];
    EXPECT_GE(now.probability, before[i].probability);
    now.probability = before[i].probability;
    EXPECT_TRUE(sameCuboid(before[i], now));
  }
}

TEST(PlanarMap, GivesTheSameOccupiedSpaceInAnyOrderOfFrames) {
  // Of a static scene, up to the phase of the rasters and the half cell by which a cuboid may reach
  // beyond what it stands for or stay short of it: what one order occupies, the other has within a
  // cell, and its corners within two.
  std::vector<View> views = walk(5);
  PlanarMap forward(paramsAt(0.1));
  PlanarMap backward(paramsAt(0.1));
  for (const View& view : views) forward.insert(view.frame());
  std::reverse(views.begin(), views.end());
  for (const View& view : views) backward.insert(view.frame());
  EXPECT_EQ(forward.planes().size(), backward.planes().size());
  for (const auto& [one, other] :
       {std::pair(&forward, &backward), std::pair(&backward, &forward)}) {
    for (const Cuboid& cuboid : one->cuboids()) {
      EXPECT_FALSE(other->cuboidsAt(cuboid.center, 0.1).empty());
      for (const Vector3& corner : corners(cuboid))
        EXPECT_FALSE(other->cuboidsAt(corner, 0.21).empty());
    }
  }
}

TEST(PlanarMap, ForgetsWhatItLooksThroughTwice) {
  Scene with;
  with.boxes.push_back({{-0.2, 0.9, 0.5}, {0.2, 1.2, 1.3}, false, true});
  with.boxes.push_back({{0.6, 0.9, 0.8}, {0.75, 1.05, 0.95}, false, false});
  const Pose pose = lookFrom({0.0, -0.5, 1.0});
  PlanarMap map(paramsAt(0.1));
  map.insert(look(with, pose).frame());
  const Vector3 on_ghost(0.0, 0.95, 0.9);
  const Vector3 on_clutter(0.68, 0.92, 0.88);
  EXPECT_TRUE(map.isOccupied(on_ghost));
  EXPECT_TRUE(map.isOccupied(on_clutter));
  const View without = look(Scene(), pose);
  map.insert(without.frame());
  EXPECT_TRUE(map.isOccupied(on_ghost));
  EXPECT_LT(map.occupancyAt(on_ghost), 0.75);
  map.insert(without.frame());
  EXPECT_FALSE(map.isOccupied(on_ghost));
  EXPECT_FALSE(map.isOccupied(on_clutter));
  EXPECT_GT(coverage(map, without, 0.05), 0.999);
  for (const MapPlane& plane : map.planes()) EXPECT_LT(plane.rms(), 0.02);
}

TEST(PlanarMap, FollowsTheBeliefOfThePoints) {
  const View view = look(Scene(), lookFrom({0.0, 0.0, 1.0}));
  std::vector<float> belief(view.xyz.size() / 3, 0.8f);
  FrameObservation frame = view.frame();
  frame.probability = &belief;
  PlanarMap map(paramsAt(0.1));
  map.insert(frame);
  const Vector3 on_wall(0.0, 5.02, 1.2);
  EXPECT_NEAR(map.occupancyAt(on_wall), 0.8, 0.5 * kBeliefStep + 1e-6);
  std::fill(belief.begin(), belief.end(), 0.6f);
  map.insert(frame);
  EXPECT_NEAR(map.occupancyAt(on_wall), 0.7, kBeliefStep);
  std::fill(belief.begin(), belief.end(), 0.0f);
  map.insert(frame);  // 0.35: below the least belief
  EXPECT_FALSE(map.isOccupied(on_wall));
  EXPECT_TRUE(map.cuboids().empty());
  EXPECT_TRUE(map.planes().empty());
}

TEST(PlanarMap, MapsNoGroundAndOnlyTheIndicesGiven) {
  const View view = look(Scene(), lookFrom({0.0, 0.0, 1.0}));
  Indices ground, above;
  for (std::size_t i = 0; i < view.xyz.size() / 3; ++i) {
    const Vector3 p(view.xyz[3 * i], view.xyz[3 * i + 1], view.xyz[3 * i + 2]);
    const double height = (view.pose * p).z();
    (height < 0.01 ? ground : above).push_back(static_cast<int>(i));
  }
  PlanarMap by_ground(paramsAt(0.1));
  PlanarMap by_indices(paramsAt(0.1));
  FrameObservation frame = view.frame();
  frame.ground = &ground;
  by_ground.insert(frame);
  frame.ground = nullptr;
  frame.indices = &above;
  by_indices.insert(frame);
  // But for where the ground was they know the same.
  ASSERT_EQ(by_ground.cuboids().size(), by_indices.cuboids().size());
  for (std::size_t i = 0; i < by_ground.cuboids().size(); ++i) {
    EXPECT_EQ(by_ground.cuboids()[i].center, by_indices.cuboids()[i].center);
    EXPECT_EQ(by_ground.cuboids()[i].size, by_indices.cuboids()[i].size);
  }
  EXPECT_EQ(by_ground.unknownCells(), by_indices.unknownCells());
  EXPECT_TRUE(by_indices.ground().empty());
  ASSERT_FALSE(by_ground.ground().empty());
  for (const GroundPoint& point : by_ground.ground()) EXPECT_NEAR(0.0, point.position.z(), 0.02);
  EXPECT_FALSE(by_ground.isOccupied({0.0, 1.5, -0.02}));
  EXPECT_TRUE(by_ground.isOccupied({0.0, 5.02, 1.2}));
}

TEST(PlanarMap, MapsIndicesInAnyOrderAndRepeatedOnesOnce) {
  const View view = look(Scene(), lookFrom({0.0, 0.0, 1.0}));
  // From the first to the last of eight as far apart as neighbours are, but two points only.
  Indices repeated, once;
  const auto n = static_cast<int>(view.xyz.size() / 3);
  for (int i = 0; i + 7 < n; i += 8) {
    repeated.insert(repeated.end(), {i, i, i, i, i, i, i, i + 7});
    once.insert(once.end(), {i, i + 7});
  }
  const Indices backwards(once.rbegin(), once.rend());
  const auto mapOf = [&](const Indices& indices) {
    PlanarMap map(paramsAt(0.1));
    FrameObservation frame = view.frame();
    frame.indices = &indices;
    map.insert(frame);
    return map.serialize();
  };
  EXPECT_EQ(mapOf(repeated), mapOf(once));
  EXPECT_EQ(mapOf(backwards), mapOf(once));
}

TEST(PlanarMap, IsInExactlyOneOfThreeStatesAnywhere) {
  PlanarMap map(paramsAt(0.1));
  for (const View& view : walk(3)) map.insert(view.frame());
  Random random(7);
  std::set<CellState> seen;
  for (int i = 0; i < 20000; ++i) {
    const Vector3 p(random.uniform(-4.0, 4.0), random.uniform(-2.0, 9.0),
                    random.uniform(-1.0, 3.5));
    EXPECT_EQ(map.isFree(p) + map.isOccupied(p) + map.isUnknown(p), 1);
    EXPECT_EQ(map.isOccupied(p), !map.cuboidsAt(p).empty());
    const double belief = map.occupancyAt(p);
    EXPECT_EQ(map.isFree(p), belief == 0.0);
    if (map.isUnknown(p)) {
      EXPECT_EQ(belief, 0.5);
    }
    seen.insert(map.stateAt(p));
  }
  EXPECT_EQ(seen.size(), 3u);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(map.isUnknown({nan, 0.0, 0.0}));  // a robot must not be told that it may go there
  EXPECT_TRUE(map.isUnknown({0.0, 0.0, std::numeric_limits<double>::infinity()}));
  EXPECT_TRUE(map.isUnknown({1e300, 0.0, 0.0}));
}

TEST(PlanarMap, FindsTheCuboidsABruteForceSearchFinds) {
  PlanarMap map(paramsAt(0.1));
  for (const View& view : walk(3)) map.insert(view.frame());
  Random random(11);
  for (int i = 0; i < 500; ++i) {
    const Vector3 p(random.uniform(-3.0, 3.0), random.uniform(-2.0, 6.0),
                    random.uniform(-0.5, 3.0));
    for (const double margin : {0.0, 0.07, 1.0}) {
      Indices expected;
      for (std::size_t k = 0; k < map.cuboids().size(); ++k) {
        if (contains(map.cuboids()[k], p, margin)) expected.push_back(static_cast<int>(k));
      }
      EXPECT_EQ(map.cuboidsAt(p, margin), expected);
    }
  }
  EXPECT_THROW(map.cuboidsAt(Vector3::Zero(), -1.0), ParameterError);
  EXPECT_THROW(map.cuboidsAt(Vector3::Zero(), std::nan("")), ParameterError);
}

TEST(PlanarMap, CopiesAndMovesByValue) {
  PlanarMap map(paramsAt(0.1));
  const std::vector<View> views = walk(2);
  map.insert(views[0].frame());
  PlanarMap copy(map);
  const std::vector<std::uint8_t> before = map.serialize();
  copy.insert(views[1].frame());
  EXPECT_EQ(map.serialize(), before);
  EXPECT_NE(copy.serialize(), before);
  PlanarMap moved(std::move(copy));
  EXPECT_EQ(moved.frames(), 2u);
  copy = map;
  EXPECT_EQ(copy.serialize(), before);
  copy.clear();
  EXPECT_TRUE(copy.empty());
  EXPECT_EQ(copy.params().approximation.resolution, 0.1);
  EXPECT_GT(map.memoryBytes(), copy.memoryBytes());
}

TEST(PlanarMap, RejectsWhatDoesNotFitTogetherAndStaysAsItWas) {
  PlanarMap map(paramsAt(0.1));
  const View view = look(Scene(), lookFrom({0.0, 0.0, 1.0}));
  map.insert(view.frame());
  const std::vector<std::uint8_t> before = map.serialize();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto rejects = [&](auto&& spoil) {
    FrameObservation frame = view.frame();
    spoil(frame);
    EXPECT_THROW(map.insert(frame), InputError);
    EXPECT_EQ(map.serialize(), before);
  };
  rejects([&](FrameObservation& f) { f.T_world_sensor.translation().x() = nan; });
  rejects([&](FrameObservation& f) { f.T_world_sensor.linear()(1, 1) = nan; });
  rejects([&](FrameObservation& f) { f.T_world_sensor.linear() *= 2.0; });
  rejects([&](FrameObservation& f) { f.T_world_sensor.linear().col(0) *= -1.0; });
  rejects([&](FrameObservation& f) { f.T_world_sensor.translation().y() = 2e14; });
  rejects([&](FrameObservation& f) { f.timestamp = nan; });
  const Indices too_high{0, static_cast<int>(view.xyz.size() / 3)};
  const Indices negative{-1};
  rejects([&](FrameObservation& f) { f.indices = &too_high; });
  rejects([&](FrameObservation& f) { f.ground = &negative; });
  std::vector<PlaneSegment> planes = view.planes;
  planes[0].inliers.push_back(too_high[1]);
  rejects([&](FrameObservation& f) { f.planes = &planes; });
  planes = view.planes;
  planes[0].plane.normal.x() = nan;
  rejects([&](FrameObservation& f) { f.planes = &planes; });
  const std::vector<float> too_few{1.0f};
  std::vector<float> above_one(view.xyz.size() / 3, 1.5f);
  rejects([&](FrameObservation& f) { f.probability = &too_few; });
  rejects([&](FrameObservation& f) { f.probability = &above_one; });
  rejects([&](FrameObservation& f) { f.camera->fx = 0.0; });
  rejects([&](FrameObservation& f) { f.camera->width = 7; });
  rejects([&](FrameObservation& f) { f.points.data = nullptr; });
}

/// The others: Parameters.PlanarMapping of tests/contract.
TEST(PlanarMap, RejectsBadParameters) {
  const auto rejects = [](auto&& spoil) {
    PlanarMapParams params;
    spoil(params);
    EXPECT_THROW(PlanarMap{params}, ParameterError);
  };
  rejects([](PlanarMapParams& p) { p.association_angle = std::nan(""); });
  rejects([](PlanarMapParams& p) { p.association_offset = -0.1; });
  rejects([](PlanarMapParams& p) { p.belief_gain = 0.0; });
  rejects([](PlanarMapParams& p) { p.miss_factor = 2.0; });
  rejects([](PlanarMapParams& p) { p.first_belief = 0.0; });
  rejects([](PlanarMapParams& p) { p.noise_factor = -1.0; });
  rejects([](PlanarMapParams& p) { p.min_cell_fraction = std::nan(""); });
  rejects([](PlanarMapParams& p) { p.miss_range = std::nan(""); });
  rejects([](PlanarMapParams& p) { p.max_range = 1e6; });  // would be 1e21 unknown cells
}

TEST(PlanarMap, SurvivesEmptyAndHostileClouds) {
  PlanarMap map(paramsAt(0.1));
  FrameObservation empty;
  map.insert(empty);
  EXPECT_EQ(map.frames(), 1u);
  const float inf = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> xyz{nan,  nan,  nan,   inf,    0.0f,  1.0f,  1e9f, 0.0f,
                               0.0f, 0.0f, 0.0f,  0.0f,   1.0f,  2.0f,  3.0f, 1.0f,
                               2.0f, 3.0f, 3e38f, -3e38f, 3e38f, -1e9f, 1e9f, 1e9f};
  std::vector<PlaneSegment> planes(2);
  planes[0].inliers = {0, 1, 2, 6};  // nothing a plane could be made of
  planes[1].inliers = {};
  FrameObservation frame;
  frame.points = PointsView(xyz.data(), xyz.size() / 3);
  frame.planes = &planes;
  const FrameUpdate update = map.insert(frame);
  EXPECT_GE(update.dropped_points, 4u);
  EXPECT_TRUE(map.isOccupied({1.05, 2.05, 3.05}));
  EXPECT_LT(map.memoryBytes(), 50u << 20);
  frame.T_world_sensor.translation() = Vector3(1e12, -1e12, 0.0);
  map.insert(frame);
  EXPECT_EQ(map.frames(), 3u);
  const std::vector<std::uint8_t> file = map.serialize();
  EXPECT_EQ(PlanarMap::deserialize(file.data(), file.size()).frames(), 3u);
  EXPECT_EQ(PlanarMap::deserialize(file.data(), file.size()).params().approximation.threads, 1);
  const PlanarMap quick = PlanarMap::deserialize(file.data(), file.size(), 3);
  EXPECT_EQ(quick.params().approximation.threads, 3);
  EXPECT_EQ(quick.serialize(), file);
  EXPECT_THROW(PlanarMap::deserialize(file.data(), file.size(), -1), ParameterError);
}

TEST(PlanarMap, WorksFarFromTheOrigin) {
  const Vector3 shift(40000.0, -30000.0, 200.0);
  PlanarMap here(paramsAt(0.1));
  PlanarMap there(paramsAt(0.1));
  for (const View& view : walk(2)) {
    FrameObservation frame = view.frame();
    here.insert(frame);
    frame.T_world_sensor.translation() += shift;
    there.insert(frame);
  }
  EXPECT_EQ(here.planes().size(), there.planes().size());
  EXPECT_NEAR(static_cast<double>(here.cuboids().size()),
              static_cast<double>(there.cuboids().size()), 3.0);
  EXPECT_TRUE(there.isOccupied(shift + Vector3(0.0, 5.02, 1.2)));
}

TEST(PlanarMap, CostsAFrameWhatTheFrameCosts) {
  // Rooms side by side: the patches rebuilt for the last do not grow with the number of rooms.
  PlanarMap map(paramsAt(0.1));
  std::size_t first = 0, last = 0;
  for (int room = 0; room < 12; ++room) {
    FrameObservation frame;
    const View view = look(Scene(), lookFrom({0.0, 0.0, 1.0}));
    frame = view.frame();
    frame.T_world_sensor.translation().x() += 50.0 * room;
    const FrameUpdate update = map.insert(frame);
    (room == 0 ? first : last) = update.patches_rebuilt;
  }
  EXPECT_LE(last, 2 * first);
}

}  // namespace
}  // namespace planar_mapping
