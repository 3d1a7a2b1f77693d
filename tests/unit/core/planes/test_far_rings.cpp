// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "planar_mapping/core/planes/multi_plane.h"

namespace planar_mapping {
namespace {

/// What a scanner of rings two degrees apart, 1.2 m above the floor, sees of a hall of 30 x 20 m,
/// and perhaps of a table 0.4 m below it with a wall behind.
struct Rings {
  std::vector<float> xyz;
  std::vector<int> surface;  ///< 0 floor, 1 table, 2 walls, 3 ceiling

  Rings(double wall, bool table) {
    for (double elevation = -29.0; elevation <= 29.0; elevation += 2.0) {
      for (double azimuth = -180.0; azimuth < 180.0; azimuth += 0.2)
        cast(elevation, azimuth, wall, table);
    }
  }
  PlaneSet planes() const {
    MultiPlaneParams params;
    params.min_inliers = static_cast<int>(surface.size() / 300);
    return findPlanes(PointsView(xyz.data(), surface.size()), nullptr, params);
  }

 private:
  void cast(double elevation, double azimuth, double wall, bool table) {
    const double e = elevation * M_PI / 180.0, a = azimuth * M_PI / 180.0;
    const Vector3 ray(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
    double range = 1e9;
    int hit = -1;
    const auto meet = [&](double distance, int what) {
      if (distance > 0.0 && distance < range) {
        range = distance;
        hit = what;
      }
    };
    meet(-1.2 / ray.z(), 0);
    meet(6.0 / ray.z(), 3);
    meet(wall / ray.x(), 2);
    meet(-20.0 / ray.x(), 2);
    meet(9.0 / std::abs(ray.y()), 2);
    const Vector3 on_table = ray * (-0.4 / ray.z());
    if (table && on_table.x() > 0.8 && on_table.x() < 2.2 && std::abs(on_table.y()) < 1.0)
      meet(-0.4 / ray.z(), 1);
    const Eigen::Vector3f p = (range * ray).cast<float>();
    xyz.insert(xyz.end(), p.data(), p.data() + 3);
    surface.push_back(hit);
  }
};

TEST(FarRings, OfAFloorAreOnItsPlane) {
  const Rings rings(10.0, false);
  const PlaneSet set = rings.planes();
  std::vector<char> on(rings.surface.size(), 0);
  for (const PlaneSegment& plane : set.planes) {
    for (const int i : plane.inliers) on[static_cast<std::size_t>(i)] = 1;
  }
  int far = 0, found = 0;
  for (std::size_t i = 0; i < on.size(); ++i) {
    const double range = std::hypot(rings.xyz[3 * i], rings.xyz[3 * i + 1]);
    if (rings.surface[i] != 0 || range < 6.0) continue;
    ++far;
    found += on[i];
  }
  ASSERT_GT(far, 3000);
  EXPECT_GT(found, 0.9 * far);
}

TEST(FarRings, OfAWallAreNotOnATableOfTheirHeight) {
  for (double wall = 2.5; wall < 9.0; wall += 0.25) {
    const Rings rings(wall, true);
    std::size_t tables = 0;
    for (const PlaneSegment& plane : rings.planes().planes) {
      std::vector<std::size_t> of(4, 0);
      for (const int i : plane.inliers)
        ++of[static_cast<std::size_t>(rings.surface[static_cast<std::size_t>(i)])];
      if (of[1] < of[2] || of[1] == 0) continue;
      ++tables;
      // Where the table ends, a ring or two of the wall may be as high.
      EXPECT_LE(of[2], 0.01 * static_cast<double>(of[1])) << wall;
    }
    EXPECT_EQ(1u, tables) << wall;
  }
}

}  // namespace
}  // namespace planar_mapping
