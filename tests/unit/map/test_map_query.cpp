// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/map_query.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "evaluation/metrics/cuboid_geometry.h"
#include "map_scene.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping {
namespace {

using namespace test;

/// The room of map_scene.h, seen from its middle: a cabinet 2.04 m in front, unknown behind it.
PlanarMap roomMap(int frames = 1, Unseen unseen = Unseen::Unknown) {
  PlanarMapParams params;
  params.unseen = unseen;
  PlanarMap map(params);
  for (int i = 0; i < frames; ++i)
    map.insert(look(Scene(), lookFrom({0.1 * i, 0.0, 1.0}), 0.1 * i).frame());
  return map;
}

TEST(StateAt, FacesEdgesAndCornersAreOfTheirCuboid) {
  for (const double yaw : {0.0, 0.3}) {
    Pose pose = lookFrom({0.0, 0.0, 1.0});
    pose.rotate(Eigen::AngleAxisd(yaw, Vector3::UnitY()));
    PlanarMap map;
    map.insert(look(Scene(), pose).frame());
    ASSERT_GT(map.cuboids().size(), 10U);
    for (const Cuboid& cuboid : map.cuboids()) {
      for (int i = 0; i < 27; ++i) {
        const Vector3 sign(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
        const Vector3 point =
            cuboid.center + cuboid.orientation * Vector3(0.5 * sign.cwiseProduct(cuboid.size));
        EXPECT_EQ(map.stateAt(point), CellState::Occupied) << point.transpose();
        EXPECT_FALSE(map.cuboidsAt(point).empty());
        EXPECT_GT(map.occupancyAt(point), 0.0);
      }
    }
  }
}

TEST(CastRay, HitsTheWallWhereItIs) {
  const PlanarMap map = roomMap();
  // Over the boxes to the far wall at y = 5; the direction need not be of unit length.
  const auto hit = castRay(map, {-0.8, 2.0, 1.2}, {0.0, 3.0, 0.0}, 20.0);
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->state, CellState::Occupied);
  EXPECT_NEAR(hit->distance, 3.0, 0.1);
  EXPECT_NEAR(hit->point.y(), 5.0, 0.1);
  ASSERT_GE(hit->cuboid, 0);
  const Cuboid& wall = map.cuboids()[static_cast<std::size_t>(hit->cuboid)];
  EXPECT_GE(wall.plane_id, 0);
  EXPECT_NEAR(test::distanceTo(wall, hit->point), 0.0, 1e-9);
}

TEST(CastRay, MeetsTheSurfaceThatItsSensorSaw) {
  // From the sensor through pixels of its image, but for the rim, where cells are seen in part: not
  // unknown is the rest of a cell that the surface cuts.
  const test::View view = look(Scene(), lookFrom({0.0, 0.0, 1.0}));
  PlanarMap map;
  map.insert(view.frame());
  int occupied = 0, all = 0;
  for (int row = 32; row < 208; row += 8) {
    for (int column = 32; column < 288; column += 8) {
      const float* p = &view.xyz[3 * static_cast<std::size_t>(row * 320 + column)];
      const Vector3 point = view.pose * Vector3(p[0], p[1], p[2]);
      if (point.z() < 0.2) continue;  // the floor is seen at a glancing angle
      const Vector3 origin = view.pose.translation();
      const auto hit = castRay(map, origin, point - origin, 20.0);
      ++all;
      ASSERT_TRUE(hit.has_value());
      EXPECT_GT(hit->distance, 0.5);
      occupied += hit->state == CellState::Occupied ? 1 : 0;
    }
  }
  EXPECT_GT(all, 300);
  EXPECT_GE(occupied, all * 8 / 10);  // the others pass close by the edges of boxes
}

TEST(CastRay, StopsAtUnknownSpaceUnlessItIsTransparent) {
  const PlanarMap map = roomMap();
  // From above, down behind the cabinet (its back is at y = 2.96, its top at z = 0.83).
  const Vector3 origin(-0.77, 3.2, 1.6);
  const Vector3 down(0.0, 0.0, -1.0);
  const auto unknown = castRay(map, origin, down, 5.0);
  ASSERT_TRUE(unknown.has_value());
  EXPECT_EQ(unknown->state, CellState::Unknown);
  EXPECT_EQ(unknown->cuboid, -1);
  EXPECT_GT(unknown->distance, 0.6);
  EXPECT_LT(unknown->distance, 1.0);
  EXPECT_TRUE(map.isUnknown(unknown->point + 0.01 * down));
  EXPECT_FALSE(map.isUnknown(unknown->point - 0.01 * down));
  const auto through = castRay(map, origin, down, 5.0, UnknownSpaceIs::Transparent);
  EXPECT_TRUE(!through.has_value() || through->state == CellState::Occupied);
}

TEST(CastRay, AgreesWithTheStateOfPointsAlongIt) {
  const PlanarMap map = roomMap(3);
  Random random(3);
  int hits = 0;
  for (int i = 0; i < 600; ++i) {
    const Vector3 origin(random.uniform(-1.5, 1.5), random.uniform(0.0, 4.5),
                         random.uniform(0.2, 2.4));
    const Vector3 direction(random.normal(), random.normal(), random.normal());
    const Vector3 along = direction.normalized();
    const auto hit = castRay(map, origin, direction, 4.0);
    const double end = hit ? hit->distance : 4.0;
    // Of the cell that a cuboid cuts the rest may be unknown.
    const double gap = hit && hit->state == CellState::Occupied ? 0.1 * std::sqrt(3.0) : 0.0;
    for (double t = 0.005; t < end - 1e-9 - gap; t += 0.01)
      ASSERT_EQ(map.stateAt(origin + t * along), CellState::Free) << i << " at " << t;
    if (!hit || hit->distance == 0.0) continue;
    ++hits;
    if (hit->state == CellState::Occupied) {
      EXPECT_FALSE(map.cuboidsAt(hit->point, 1e-9).empty());
    } else {
      EXPECT_TRUE(map.isUnknown(hit->point + 1e-6 * along));
    }
  }
  EXPECT_GT(hits, 100);
}

TEST(CastRay, FindsTheCuboidThatALinearSearchFinds) {
  const PlanarMap map = roomMap(3);
  const std::vector<Cuboid>& cuboids = map.cuboids();
  ASSERT_GT(cuboids.size(), 20u);
  Random random(4);
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    Vector3 origin(random.uniform(-3.0, 3.0), random.uniform(-1.0, 6.0), random.uniform(-1.0, 4.0));
    Vector3 along(random.normal(), random.normal(), random.normal());
    if (i % 4 == 0) along = Vector3::Unit(i / 4 % 3) * (i % 8 == 0 ? 1.0 : -1.0);
    along.normalize();
    if (i % 10 == 0) origin -= 1e6 * along;  // beyond what the lattice of space can hold
    const double range = i % 10 == 0 ? 1.1e6 : 4.0;
    std::int32_t first = -1;
    double nearest = range;
    for (std::size_t c = 0; c < cuboids.size(); ++c) {
      const Matrix3 to_local = cuboids[c].orientation.toRotationMatrix().transpose();
      const Vector3 from = to_local * (origin - cuboids[c].center);
      const Vector3 way = to_local * along;
      double enter = 0.0;
      double leave = range;
      for (int k = 0; k < 3; ++k) {
        const double a = (-0.5 * cuboids[c].size[k] - from[k]) / way[k];
        const double b = (0.5 * cuboids[c].size[k] - from[k]) / way[k];
        enter = std::max(enter, std::min(a, b));
        leave = std::min(leave, std::max(a, b));
      }
      if (enter > leave || (first >= 0 && enter >= nearest)) continue;
      nearest = enter;
      first = static_cast<std::int32_t>(c);
    }
    const auto hit = castRay(map, origin, along, range, UnknownSpaceIs::Transparent);
    ASSERT_EQ(hit.has_value(), first >= 0) << i;
    if (!hit) continue;
    ++hits;
    EXPECT_NEAR(hit->distance, nearest, 1e-9 * range) << i;
    if (range < 1e3) {
      EXPECT_EQ(hit->cuboid, first) << i;
    }
  }
  EXPECT_GT(hits, 500);
}

TEST(CastRay, ComesFromAfarThroughUnknownSpace) {
  const PlanarMap map = roomMap(1, Unseen::Free);
  // Along a border of cells, from where no cell has a number, to the hidden space behind the
  // cabinet.
  const Vector3 origin(-0.8, 3.2, 2e5);
  const auto hit = castRay(map, origin, {0.0, 0.0, -1.0}, 3e5);
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->state, CellState::Unknown);
  EXPECT_LT(hit->point.z(), 2.0);
  // Where nothing is known it is at an end at once.
  const auto unseen = castRay(roomMap(), origin, {0.0, 0.0, -1.0}, 3e5);
  ASSERT_TRUE(unseen.has_value());
  EXPECT_EQ(unseen->state, CellState::Unknown);
  EXPECT_EQ(unseen->distance, 0.0);
}

TEST(CastRay, RefusesWhatIsNoRay) {
  const PlanarMap map = roomMap();
  EXPECT_THROW(castRay(map, Vector3::Zero(), Vector3::Zero(), 1.0), ParameterError);
  EXPECT_THROW(castRay(map, Vector3::Zero(), Vector3::UnitX(), 0.0), ParameterError);
  EXPECT_THROW(castRay(map, Vector3::Zero(), Vector3::UnitX(), 1e9), ParameterError);
  EXPECT_THROW(castRay(map, {NAN, 0.0, 0.0}, Vector3::UnitX(), 1.0), ParameterError);
}

TEST(StateOfBox, IsThatOfItsWorstPart) {
  const PlanarMap map = roomMap();
  EXPECT_EQ(stateOfBox(map, {-0.2, 0.9, 0.7}, {0.2, 1.3, 0.9}).state, CellState::Free);
  EXPECT_EQ(stateOfBox(map, {-0.2, -0.4, 0.7}, {0.2, 1.3, 0.9}).state, CellState::Unknown);
  EXPECT_EQ(stateOfBox(map, {1e7, 1e7, 1e7}, {1e7, 1e7, 1e7}).state, CellState::Unknown);
  EXPECT_EQ(stateOfBox(map, {-1.0, 3.1, 0.2}, {-0.6, 3.3, 0.4}).state, CellState::Unknown);
  const BoxState wall = stateOfBox(map, {-0.5, 4.8, 1.0}, {0.5, 5.2, 1.5});
  EXPECT_EQ(wall.state, CellState::Occupied);
  ASSERT_FALSE(wall.cuboids.empty());
}

TEST(StateOfBox, MeetsTurnedCuboidsExactly) {
  // A bar of 2 m along the diagonal of x and y, and its own bounding box's empty corner.
  PlanarMapParams params;
  params.unknown_space = false;
  PlanarMap map(params);
  Scene scene;
  map.insert(look(scene, lookFrom({0.0, 0.0, 1.0}, 0.6), 0.0).frame());
  Random random(9);
  int occupied = 0;
  for (int i = 0; i < 300; ++i) {
    const Vector3 low(random.uniform(-2.2, 2.0), random.uniform(0.0, 5.0),
                      random.uniform(-0.2, 2.0));
    const Vector3 high = low + Vector3(0.05, 0.2, 0.1);
    const BoxState box = stateOfBox(map, low, high);
    // Dense points of the box are in the cuboids that it is said to meet, and in no others.
    Indices met;
    for (int k = 0; k < 11 * 21 * 11; ++k) {
      const Vector3 part(k % 11 / 10.0, k / 11 % 21 / 20.0, k / 231 / 10.0);
      for (const int c : map.cuboidsAt(low + part.cwiseProduct(high - low))) met.push_back(c);
    }
    std::sort(met.begin(), met.end());
    met.erase(std::unique(met.begin(), met.end()), met.end());
    EXPECT_TRUE(std::includes(box.cuboids.begin(), box.cuboids.end(), met.begin(), met.end()));
    for (const int c : box.cuboids) {  // what points between miss is only touched
      double nearest = 1.0;
      for (int k = 0; k < 11 * 21 * 11; ++k) {
        const Vector3 part(k % 11 / 10.0, k / 11 % 21 / 20.0, k / 231 / 10.0);
        nearest = std::min(nearest, test::distanceTo(map.cuboids()[static_cast<std::size_t>(c)],
                                                     low + part.cwiseProduct(high - low)));
      }
      EXPECT_LT(nearest, 0.01);
    }
    occupied += box.cuboids.empty() ? 0 : 1;
  }
  EXPECT_GT(occupied, 20);
}

TEST(StateOfBox, RefusesWhatIsNoBox) {
  const PlanarMap map = roomMap();
  EXPECT_THROW(stateOfBox(map, {1.0, 0.0, 0.0}, {0.0, 1.0, 1.0}), ParameterError);
  EXPECT_THROW(stateOfBox(map, {0.0, 0.0, 0.0}, {INFINITY, 1.0, 1.0}), ParameterError);
  EXPECT_THROW(stateOfBox(map, {10.0, 10.0, 10.0}, {110.0, 110.0, 110.0}), ParameterError);
}

TEST(CompareMaps, OfAMapWithItselfIsNothing) {
  const PlanarMap map = roomMap();
  const MapDifference same = compareMaps(map, map);
  EXPECT_GT(same.in_both, 1000u);
  EXPECT_EQ(same.fraction(), 0.0);
  EXPECT_DOUBLE_EQ(same.cell, 0.05);
  EXPECT_EQ(compareMaps(PlanarMap(), PlanarMap()).fraction(), 0.0);
}

TEST(CompareMaps, CountsWhatOnlyOneHas) {
  const PlanarMap map = roomMap();
  const MapDifference all = compareMaps(map, PlanarMap());
  EXPECT_EQ(all.fraction(), 1.0);
  EXPECT_EQ(all.only_in_b, 0u);
  // As many as there are centres of cells of 0.05 m in cuboids.
  Vector3 low, high;
  ASSERT_TRUE(map.bounds(low, high));
  const Vector3 first = (low / 0.05).array().floor();
  const Vector3 last = (high / 0.05).array().floor();
  std::size_t centres = 0;
  for (double x = first.x(); x <= last.x(); ++x) {
    for (double y = first.y(); y <= last.y(); ++y) {
      for (double z = first.z(); z <= last.z(); ++z)
        centres += map.isOccupied(0.05 * Vector3(x + 0.5, y + 0.5, z + 0.5)) ? 1 : 0;
    }
  }
  EXPECT_NEAR(static_cast<double>(all.only_in_a), static_cast<double>(centres), 1e-3 * centres);
  const PlanarMap more = roomMap(5);
  const MapDifference grown = compareMaps(map, more);
  EXPECT_GT(grown.only_in_b, 0u);
  EXPECT_GT(grown.fraction(), 0.0);
  EXPECT_LT(grown.fraction(), 0.5);
  EXPECT_EQ(compareMaps(more, map).only_in_a, grown.only_in_b);
}

}  // namespace
}  // namespace planar_mapping
