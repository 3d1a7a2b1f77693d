// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/planar_map.h"
#include "ring_scan.h"

namespace planar_mapping {
namespace {

/// Of 16 rings a third of the pixels of a room are measured: a wrong point in its middle, seen
/// once, is passed between them, while nothing of walls, floor and ceiling goes.
TEST(Misses, WrongPointsAreLostBetweenTheRingsOfAScanner) {
  Random random(5);
  const Vector3 wrong(0.5, 0.3, 0.05);
  PlanarMap map;
  std::vector<Vector3> first;
  for (int i = 0; i < 9; ++i) {
    const double a = 2.0 * M_PI * i / 9.0;
    Pose pose = Pose::Identity();
    pose.translation() << 2.2 * std::cos(a), 1.6 * std::sin(a), 0.1 * std::sin(3.0 * a);
    const Eigen::Array3d at = pose.translation().array();
    std::vector<float> xyz = test::ringScan(Eigen::Array3d(-4.0, -3.0, -1.1) - at,
                                            Eigen::Array3d(4.0, 3.0, 1.9) - at, 0.0, 0.01, random);
    if (i == 0) {
      for (std::size_t k = 0; k < xyz.size(); k += 3)
        first.push_back(pose * Vector3(xyz[k], xyz[k + 1], xyz[k + 2]));
      const Eigen::Vector3f p = (pose.inverse() * wrong).cast<float>();
      std::copy_n(p.data(), 3, xyz.begin());
    }
    FrameObservation frame;
    frame.points = PointsView(xyz.data(), xyz.size() / 3);
    frame.T_world_sensor = pose;
    map.insert(frame);
    ASSERT_TRUE(i > 0 || !map.cuboidsAt(wrong, 0.05).empty());
  }
  EXPECT_TRUE(map.cuboidsAt(wrong, 0.05).empty());
  EXPECT_EQ(map.stateAt(wrong), CellState::Free);
  std::size_t lost = 0;
  for (const Vector3& point : first) lost += map.cuboidsAt(point, 0.05).empty() ? 1 : 0;
  EXPECT_LT(static_cast<double>(lost), 0.002 * static_cast<double>(first.size()));
}

/// Edges leave points in the air, one of a hundred here, in every scan: they neither hide each
/// other from the rays that pass them nor become cells where a surface would have many points.
TEST(Misses, StrayPointsOfManyScansAreFew) {
  Random random(6);
  PlanarMap map;
  std::size_t strays = 0;
  const Eigen::Array3d low(-4.0, -3.0, -1.1), high(4.0, 3.0, 1.9);
  for (int i = 0; i < 9; ++i) {
    const double a = 2.0 * M_PI * i / 9.0;
    Pose pose = Pose::Identity();
    pose.translation() << 2.2 * std::cos(a), 1.6 * std::sin(a), 0.0;
    const Eigen::Array3d at = pose.translation().array();
    std::vector<float> xyz = test::boxScan(low - at, high - at, 40.0);
    for (std::size_t k = 0; k < xyz.size(); k += 3) {
      if (random.uniform() > 0.01) continue;
      const auto part = static_cast<float>(0.4 + 0.4 * random.uniform());
      for (std::size_t axis = 0; axis < 3; ++axis) xyz[k + axis] *= part;
      ++strays;
    }
    FrameObservation frame;
    frame.points = PointsView(xyz.data(), xyz.size() / 3);
    frame.T_world_sensor = pose;
    map.insert(frame);
  }
  std::size_t left = 0;  // away from all walls
  for (const Cuboid& cuboid : map.cuboids()) {
    const Eigen::Array3d c = cuboid.center.array();
    left += (c > low + 0.2).all() && (c < high - 0.2).all() ? 1 : 0;
  }
  EXPECT_GT(strays, 4000u);
  EXPECT_LT(left, 600u);
}

/// A scanner drives over a floor of which it later sees every place only at a slant: rays that pass
/// a cell within its size meet the same floor a little farther on and take nothing of it away.
TEST(Misses, AFloorIsNotLostToRaysThatMeetItFartherOn) {
  Random random(8);
  PlanarMap map;
  std::vector<Vector3> floor;
  for (int i = 0; i < 7; ++i) {
    Pose pose = Pose::Identity();
    pose.translation() << (i < 3 ? 1.2 * i : 12.0 + 4.0 * i), -1.2, 0.01 * (i % 3);
    const Eigen::Array3d at = pose.translation().array();
    std::vector<float> xyz = test::boxScan(Eigen::Array3d(-20.0, -7.5, -1.7) - at,
                                           Eigen::Array3d(60.0, 7.5, 4.0) - at, 25.0, 0.4);
    std::vector<PlaneSegment> planes(1);
    planes[0].plane = {Vector3::UnitZ(), 1.7 + at.z()};
    for (std::size_t k = 0; k < xyz.size(); k += 3) {
      Eigen::Map<Eigen::Vector3f> measured(&xyz[k]);
      measured *= static_cast<float>(1.0 + 0.02 * random.normal() / measured.norm());
      const Vector3 point = measured.cast<double>();
      if (std::abs(planes[0].plane.signedDistance(point)) > 0.05) continue;
      planes[0].inliers.push_back(static_cast<int>(k / 3));
      planes[0].moments.add(point);
      if (i < 3 && k % 60 == 0 && point.norm() < 7.0) floor.push_back(pose * point);
    }
    FrameObservation frame;
    frame.points = PointsView(xyz.data(), xyz.size() / 3);
    frame.T_world_sensor = pose;
    frame.planes = &planes;
    map.insert(frame);
  }
  std::size_t lost = 0;
  for (const Vector3& point : floor) lost += map.cuboidsAt(point, 0.1).empty() ? 1 : 0;
  ASSERT_GT(floor.size(), 5000u);
  EXPECT_LT(static_cast<double>(lost), 0.002 * static_cast<double>(floor.size())) << floor.size();
}

/// A ray that meets the edge of a pillar may end between it and the wall. In space that was seen
/// free such a point is none, if it is alone; elsewhere it is one, and so is what others believe.
TEST(Misses, APointBetweenAPillarAndTheWallIsLeftOut) {
  const auto isThere = [](double at_degrees, float belief, bool was_free) {
    constexpr double kPillar = 2.0;  // metres, 20 degrees of the view
    PlanarMap map;
    Vector3 stray = Vector3::Zero();
    for (const bool first : {true, false}) {
      if (first && !was_free) continue;
      std::vector<float> xyz = test::boxScan({-5.0, -4.0, -1.1}, {5.0, 4.0, 1.9}, 20.0);
      std::vector<float> beliefs(xyz.size() / 3, 1.0F);
      for (std::size_t k = 0; !first && k < xyz.size(); k += 3) {
        const double degrees = std::atan2(xyz[k + 1], xyz[k]) * 180.0 / M_PI;
        Eigen::Map<Eigen::Vector3f> point(&xyz[k]);
        if (std::abs(degrees) < 10.0) point *= static_cast<float>(kPillar) / point.x();
        if (std::abs(degrees - at_degrees) > 0.1 || std::abs(point.z()) > 1e-3F) continue;
        point *= 3.4F / point.norm();
        stray = point.cast<double>();
        beliefs[k / 3] = belief;
      }
      FrameObservation frame;
      frame.points = PointsView(xyz.data(), xyz.size() / 3);
      frame.probability = &beliefs;
      map.insert(frame);
    }
    EXPECT_GT(stray.norm(), 1.0);
    return map.stateAt(stray) == CellState::Occupied;
  };
  EXPECT_FALSE(isThere(10.0, 0.5F, true));
  EXPECT_TRUE(isThere(10.0, 0.9F, true));
  EXPECT_TRUE(isThere(10.0, 0.5F, false));
  EXPECT_TRUE(isThere(20.0, 0.5F, true)) << "away from the edge";
}

/// A thing across a hall, 5 cm thick, 2 m before its far wall.
struct Across {
  double low, high;  ///< of its height, metres
  /// Points of a scan that is not turned end at it. \return how many, by tenths of its 4 m
  std::vector<int> cut(const Vector3& sensor, std::vector<float>& xyz) const {
    constexpr double kFront = 8.0;
    std::vector<int> hits(40, 0);
    for (std::size_t k = 0; k < xyz.size(); k += 3) {
      const double part = (kFront - sensor.x()) / xyz[k];
      const double y = sensor.y() + part * xyz[k + 1], z = sensor.z() + part * xyz[k + 2];
      if (!(part > 0.0 && part < 1.0 && std::abs(y) < 2.0 && z > low && z < high)) continue;
      for (std::size_t axis = 0; axis < 3; ++axis)
        xyz[k + axis] *= static_cast<float>(part + 0.01 / xyz[k]);
      ++hits[static_cast<std::size_t>((y + 2.0) * 10.0)];
    }
    return hits;
  }
};

/// Points of a scan 1 cm behind the front of the thing.
PlaneSegment frontOf(const Vector3& sensor, const std::vector<float>& xyz) {
  PlaneSegment front;
  front.plane = {-Vector3::UnitX(), 8.01 - sensor.x()};
  for (std::size_t k = 0; k < xyz.size(); k += 3) {
    const Vector3 point(xyz[k], xyz[k + 1], xyz[k + 2]);
    if (std::abs(front.plane.signedDistance(point)) > 1e-3) continue;
    front.inliers.push_back(static_cast<int>(k / 3));
    front.moments.add(point);
  }
  return front;
}

/// The first so many of 41 scans, and in how many of them the thing is in place.
struct Scans {
  int all, with_thing;
  bool is_dense = false;  ///< a ring every degree, and the thing is a plane; else 16 rings
};

/// A scanner comes from 8 m to 2 m before the thing and goes back.
/// \return how many of its hit tenths are occupied, are free
std::pair<int, int> approach(const Across& thing, const Scans& scans, int& hit) {
  Random random(7);
  PlanarMap map;
  std::vector<int> hits(40, 0);
  for (int i = 0; i < scans.all; ++i) {
    Pose pose = Pose::Identity();
    pose.translation() << 6.0 - 0.3 * std::abs(i - 20), 0.2 * std::sin(i),
        0.2 * random.uniform(-1.0, 1.0);
    const Eigen::Array3d at = pose.translation().array();
    const Eigen::Array3d low = Eigen::Array3d(-2.0, -3.0, -0.8) - at;
    const Eigen::Array3d high = Eigen::Array3d(10.0, 3.0, 2.2) - at;
    std::vector<float> xyz = scans.is_dense ? test::boxScan(low, high, 20.0)
                                            : test::ringScan(low, high, 0.0, 0.0, random);
    if (i < scans.with_thing) {
      const std::vector<int> fresh = thing.cut(pose.translation(), xyz);
      for (std::size_t k = 0; k < hits.size(); ++k) hits[k] += fresh[k];
    }
    FrameObservation frame;
    frame.points = PointsView(xyz.data(), xyz.size() / 3);
    frame.T_world_sensor = pose;
    const std::vector<PlaneSegment> planes{frontOf(pose.translation(), xyz)};
    if (scans.is_dense && i < scans.with_thing) frame.planes = &planes;
    map.insert(frame);
  }
  std::pair<int, int> found{0, 0};
  hit = 0;
  for (std::size_t k = 0; k < hits.size(); ++k) {
    if (hits[k] == 0) continue;
    ++hit;
    const Vector3 middle(8.03, -1.95 + 0.1 * static_cast<double>(k),
                         0.5 * (thing.low + thing.high));
    found.first += map.stateAt(middle) == CellState::Occupied ? 1 : 0;
    found.second += map.stateAt(middle) == CellState::Free ? 1 : 0;
  }
  return found;
}

/// From afar most rings pass above a bar and below it: that takes nothing of it away.
TEST(Misses, ABarIsKeptThatRingsHitNowAndThen) {
  int hit = 0;
  const int kept = approach({0.15, 0.2}, {41, 41}, hit).first;
  EXPECT_EQ(hit, 40);
  EXPECT_GE(kept, 38);
  EXPECT_GE(approach({0.15, 0.2}, {41, 41, true}, hit).first, 38);
  EXPECT_EQ(hit, 40);
}

/// Of a screen that was seen in 20 scans and is gone in the next 21 little is left.
TEST(Misses, AScreenThatIsGoneIsLostBetweenRings) {
  int hit = 0;
  const int free = approach({-0.5, 0.9}, {41, 20}, hit).second;
  EXPECT_EQ(hit, 40);
  EXPECT_GE(free, 36);
}

/// A car leaves a face wherever it was seen: rays pass the middle of few of its cells, but whatever
/// lay between them would be hit, too.
TEST(Misses, AFaceThatACarLeavesIsLostAsAWhole) {
  int hit = 0;
  const int free = approach({-0.5, 0.9}, {6, 2, true}, hit).second;
  EXPECT_EQ(hit, 40);
  EXPECT_GE(free, 38);
}

/// A person crosses before a camera that stands still. What is seen through afterwards goes, also
/// where the edge of the image cuts it and next to the floor; what stands in the room stays.
TEST(Misses, APersonWhoCrossedLeavesNothing) {
  for (const double pitch : {0.0, 0.2, 0.35}) {
    const test::Scene empty;
    const Pose pose = test::lookFrom({0.0, -0.8, 1.0}, 0.0, pitch);
    const auto addPerson = [](test::Scene& scene, double x) {
      scene.boxes.push_back({{x - 0.2, 1.2, 0.8}, {x + 0.2, 1.45, 1.75}, false, false});
      scene.boxes.push_back({{x - 0.18, 1.2, 0.0}, {x - 0.04, 1.4, 0.8}, false, false});
      scene.boxes.push_back({{x + 0.04, 1.25, 0.0}, {x + 0.18, 1.45, 0.8}, false, false});
    };
    PlanarMap map;
    constexpr int kCrossing = 20, kAfterwards = 40;
    for (int i = 0; i < kCrossing + kAfterwards; ++i) {
      test::Scene scene;
      if (i < kCrossing) addPerson(scene, -1.8 + 3.6 * i / (kCrossing - 1));
      map.insert(test::look(scene, pose, i).frame());
    }
    constexpr double kCell = 22.0;  // pixels of a cell's diagonal
    int places = 0, left = 0;
    for (double x = -1.75; x < 1.76; x += 0.1) {
      for (double y = 1.15; y < 1.5; y += 0.1) {
        for (double z = 0.12; z < 1.8; z += 0.1) {
          const Vector3 p = pose.inverse() * Vector3(x, y, z);
          const Vector2 pixel = empty.camera.project(p);
          // Cells at the very edge have their middle outside.
          const Vector2 edge(kCell, kCell);
          const Vector2 size(empty.camera.width, empty.camera.height);
          if ((pixel.array() < edge.array()).any() || (pixel.array() > (size - edge).array()).any())
            continue;
          ++places;
          left += map.stateAt({x, y, z}) == CellState::Occupied ? 1 : 0;
        }
      }
    }
    EXPECT_GT(places, 500);
    EXPECT_EQ(0, left) << "pitch " << pitch;
    const test::View view = test::look(empty, pose);
    std::size_t lost = 0;
    for (std::size_t k = 0; k < view.xyz.size(); k += 3) {
      const Vector3 point = pose * Vector3(view.xyz[k], view.xyz[k + 1], view.xyz[k + 2]);
      lost += map.cuboidsAt(point, 0.05).empty() ? 1 : 0;
    }
    EXPECT_LT(lost, view.xyz.size() / 3 / 500) << "pitch " << pitch;
  }
}

}  // namespace
}  // namespace planar_mapping
