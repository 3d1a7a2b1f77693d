// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "registration/seen_through.h"

#include <gtest/gtest.h>

#include <vector>

namespace planar_mapping::detail {
namespace {

/// What a sensor at the origin sees of a wall at z = depth, 2 m wide and high.
SeenRanges wallAt(double depth) {
  std::vector<float> xyz;
  for (int row = -50; row <= 50; ++row) {
    for (int column = -50; column <= 50; ++column) {
      xyz.insert(xyz.end(), {0.02F * static_cast<float>(column), 0.02F * static_cast<float>(row),
                             static_cast<float>(depth)});
    }
  }
  return SeenRanges(PointsView(xyz.data(), xyz.size() / 3), SurfaceMapParams());
}

/// A hundred small planes at z = depth around (x, 0), facing back along z.
std::vector<Surfel> planesAt(double depth, double x = 0.0, Vector3 normal = -Vector3::UnitZ()) {
  std::vector<Surfel> planes;
  for (int row = -5; row < 5; ++row) {
    for (int column = -5; column < 5; ++column) {
      Surfel plane;
      plane.center = {x + 0.05 * column, 0.05 * row, depth};
      plane.normal = normal;
      plane.error = 0.005;
      planes.push_back(plane);
    }
  }
  return planes;
}

TEST(SeenThrough, ComparesWhatIsWhereTheSensorLooked) {
  const SeenRanges seen = wallAt(2.0);
  const auto compare = [&](const std::vector<Surfel>& planes) {
    return seen.compare(planes, Pose::Identity());
  };
  EXPECT_EQ(100u, compare(planesAt(2.0)).compared);  // met
  EXPECT_EQ(0u, compare(planesAt(2.0)).through);
  EXPECT_EQ(100u, compare(planesAt(1.5)).compared);  // its rays went on
  EXPECT_EQ(100u, compare(planesAt(1.5)).through);
  EXPECT_EQ(1.0, compare(planesAt(1.5)).fraction());
  EXPECT_EQ(0u, compare(planesAt(2.5)).compared);                         // hidden
  EXPECT_EQ(0u, compare(planesAt(1.5, 3.0)).compared);                    // not looked at
  EXPECT_EQ(0u, compare(planesAt(1.5, 0.0, Vector3::UnitZ())).compared);  // from behind
  EXPECT_EQ(0u, compare(planesAt(1.5, 0.0, Vector3::UnitX())).compared);  // edge-on
  EXPECT_EQ(0u, compare(planesAt(1.96)).through);                         // within a cell
}

TEST(SeenThrough, PlanesAreTakenToTheSensor) {
  const SeenRanges seen = wallAt(2.0);
  Pose T_sensor_planes = Pose::Identity();
  T_sensor_planes.translation().z() = -1.0;
  EXPECT_EQ(100u, seen.compare(planesAt(2.5), T_sensor_planes).through);
  EXPECT_EQ(0u, seen.compare(planesAt(3.0), T_sensor_planes).through);
}

TEST(SeenThrough, FewPlanesSayNothing) {
  SeenThrough few = {20, 20};
  EXPECT_EQ(0.0, few.fraction());
  few += {10, 40};
  EXPECT_EQ(0.5, few.fraction());
}

}  // namespace
}  // namespace planar_mapping::detail
