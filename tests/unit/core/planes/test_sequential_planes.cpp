// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "planar_mapping/planes/multi_plane.h"
#include "plane_scenes.h"

namespace planar_mapping {
namespace {

PointsView viewOf(const std::vector<float>& xyz) {
  return {xyz.data(), xyz.size() / 3};
}

MultiPlaneParams paramsFor(std::size_t points) {
  MultiPlaneParams params;
  params.method = PlaneSearchMethod::Sequential;
  params.min_inliers = std::max(20, static_cast<int>(points / 300));
  return params;
}

TEST(SequentialPlanes, FindsTheRoomOnManySeeds) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const test::PlaneScene scene = test::makeRoom(210000, 0.3, 0.0015, seed, test::RoomKind::Dense);
    const test::PlaneScore score =
        scorePlanes(scene, findPlanes(scene.view(), nullptr, paramsFor(scene.size())));
    EXPECT_EQ(score.recall, 1.0) << seed;
    EXPECT_EQ(score.precision, 1.0) << seed;
    EXPECT_LE(score.angle_deg, 0.05) << seed;
    EXPECT_GE(score.point_recall, 0.98) << seed;
  }
}

/// A closed room of 6 x 4 x 2.5 m along the axes, its low corner at (-3, -2, -1) + \p shift, seen
/// from the origin; each point is there \p copies times.
std::vector<float> roomAlongAxes(double shift, int copies) {
  Random random(11, 5);
  std::vector<float> xyz;
  for (int i = 0; i < 40000; ++i) {
    const Vector3 ray(random.normal(), random.normal(), random.normal());
    double range = 1e9;
    for (int axis = 0; axis < 3; ++axis) {
      const double wall =
          ray[axis] > 0.0 ? Vector3(3.0, 2.0, 1.5)[axis] : Vector3(-3, -2, -1)[axis];
      range = std::min(range, (wall + shift) / ray[axis]);
    }
    const Vector3 noise(random.normal(), random.normal(), random.normal());
    const Eigen::Vector3f p = (range * ray + 0.005 * noise).cast<float>();
    for (int copy = 0; copy < copies; ++copy) xyz.insert(xyz.end(), p.data(), p.data() + 3);
  }
  return xyz;
}

// The sides of cells are walls there, and half of the points of a wall lie on either side.
TEST(SequentialPlanes, FindsWallsWhereverTheyLieInTheCells) {
  for (const double shift : {0.0, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1}) {
    const std::vector<float> xyz = roomAlongAxes(shift, 1);
    for (const double threshold : {0.025, 0.05, 0.1}) {
      MultiPlaneParams params = paramsFor(xyz.size() / 3);
      params.distance_threshold = threshold;
      const PlaneSet set = findPlanes(viewOf(xyz), nullptr, params);
      EXPECT_EQ(6u, set.planes.size()) << shift << " " << threshold;
    }
  }
}

// The plane between faces 2 to 2.4 thresholds apart is within the threshold of both or neither.
TEST(SequentialPlanes, FindsBothFacesOfAWall) {
  constexpr int kPoints = 20000;
  for (const double thickness : {0.1, 0.11, 0.12}) {
    for (const double sigma : {0.0, 0.004}) {
      for (const double shift : {0.0, 0.02, 0.05, 0.1}) {
        Random random(12);
        std::vector<float> xyz;
        for (int i = 0; i < 2 * kPoints; ++i) {
          const double x = 3.0 + shift + (i < kPoints ? 0.0 : thickness) + sigma * random.normal();
          for (const double at : {x, random.uniform(-2.0, 2.0), random.uniform(-1.0, 1.0)}) {
            xyz.push_back(static_cast<float>(at));
          }
        }
        const PlaneSet set =
            findPlanes(PointsView(xyz.data(), 2 * kPoints), nullptr, paramsFor(2 * kPoints));
        std::size_t on_face[2] = {0, 0};
        for (const PlaneSegment& plane : set.planes) {
          if (std::abs(plane.plane.normal.x()) < 0.999) continue;
          const std::size_t face = plane.inliers.front() < kPoints ? 0 : 1;
          on_face[face] = std::max(on_face[face], plane.inliers.size());
        }
        EXPECT_GT(std::min(on_face[0], on_face[1]), 0.95 * kPoints)
            << thickness << " " << sigma << " " << shift;
      }
    }
  }
}

// As lasers with two returns and clouds that were merged twice have them.
TEST(SequentialPlanes, CopiesOfPointsChangeNothing) {
  for (const int copies : {2, 4}) {
    const std::vector<float> xyz = roomAlongAxes(0.03, copies);
    const PlaneSet set = findPlanes(viewOf(xyz), nullptr, paramsFor(xyz.size() / 3));
    EXPECT_EQ(6u, set.planes.size()) << copies;
    std::size_t inliers = 0;
    for (const PlaneSegment& plane : set.planes) inliers += plane.inliers.size();
    EXPECT_GT(static_cast<double>(inliers), 0.999 * static_cast<double>(xyz.size() / 3)) << copies;
  }
}

TEST(SequentialPlanes, PointsAtTheSensorAreNoMeasurements) {
  std::vector<float> xyz = roomAlongAxes(0.03, 1);
  for (std::size_t i = 0; i < xyz.size() / 3; i += 3) std::fill_n(xyz.begin() + 3 * i, 3, 0.0f);
  const PlaneSet set = findPlanes(viewOf(xyz), nullptr, paramsFor(xyz.size() / 3));
  EXPECT_EQ(6u, set.planes.size());
  EXPECT_EQ((xyz.size() / 3 + 2) / 3, set.diagnostics.points_not_measured);
}

TEST(SequentialPlanes, OrderOfThePointsDoesNotMatter) {
  test::PlaneScene scene = test::makeRoom(30000, 0.3, 0.0015, 2, test::RoomKind::Dense);
  const MultiPlaneParams params = paramsFor(scene.size());
  const PlaneSet before = findPlanes(scene.view(), nullptr, params);
  Random random(1);
  scene.shuffle(random);
  const PlaneSet after = findPlanes(scene.view(), nullptr, params);
  ASSERT_EQ(before.planes.size(), after.planes.size());
  for (std::size_t k = 0; k < before.planes.size(); ++k) {
    const Plane& a = before.planes[k].plane;
    const Plane& b = after.planes[k].plane;
    // Sums in another order differ in the last digits; a point at the border may go either way.
    EXPECT_GT(a.normal.dot(b.normal), 1.0 - 1e-9);
    EXPECT_NEAR(a.offset, b.offset, 1e-4);
    EXPECT_NEAR(static_cast<double>(before.planes[k].inliers.size()),
                static_cast<double>(after.planes[k].inliers.size()), 5.0);
  }
}

TEST(SequentialPlanes, LaysNoPlaneThroughUnrelatedThings) {
  // Upright tubes: a level cut of 10 cm holds 4,000 points of all of them and is no surface.
  Random random(5);
  std::vector<float> xyz;
  for (int tube = 0; tube < 40; ++tube) {
    const double x = random.uniform(0, 6), y = random.uniform(0, 6);
    for (int i = 0; i < 2000; ++i) {
      const double angle = random.uniform(-M_PI, M_PI);
      const Vector3 p(x + 0.3 * std::cos(angle), y + 0.3 * std::sin(angle), random.uniform(0, 2));
      for (Eigen::Index axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(p[axis]));
    }
  }
  const PointsView view = viewOf(xyz);
  MultiPlaneParams params = paramsFor(view.size);
  params.min_inliers = 3000;
  for (const PlaneSegment& segment : findPlanes(view, nullptr, params).planes)
    EXPECT_LT(std::abs(segment.plane.normal.z()), 0.5);
}

TEST(SequentialPlanes, ShinglesAreNoLevelPlane) {
  // Tiles of 30 cm in one layer, each turned by 24 to 27 degrees its own way: every cell votes for
  // the level plane through them, which holds most of the points, and none is turned like it.
  Random random(9);
  std::vector<float> xyz;
  for (int tile = 0; tile < 400; ++tile) {
    const double slope = std::tan(random.uniform(24.0, 27.0) * M_PI / 180.0);
    const double angle = random.uniform(-M_PI, M_PI);
    for (int i = 0; i < 200; ++i) {
      const double u = random.uniform(-0.15, 0.15), v = random.uniform(-0.15, 0.15);
      const Vector3 p(
          0.3 * (tile % 20) + u, 0.3 * (tile / 20) + v,
          slope * (std::cos(angle) * u + std::sin(angle) * v) + 0.003 * random.normal());
      for (Eigen::Index axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(p[axis]));
    }
  }
  const PointsView view = viewOf(xyz);
  MultiPlaneParams params = paramsFor(view.size);
  params.min_inliers = 8000;
  EXPECT_TRUE(findPlanes(view, nullptr, params).planes.empty());
}

TEST(SequentialPlanes, ScatterBehindASurfaceIsNoPlane) {
  std::vector<float> xyz;
  Random random(10);
  for (int i = 0; i < 230000; ++i) {
    const double z = i < 200000 ? 0.003 * random.normal() : -random.uniform(0.0, 0.25);
    const Vector3 p(random.uniform(-2, 2), random.uniform(-2, 2), z);
    for (Eigen::Index axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(p[axis]));
  }
  const PlaneSet set = findPlanes(viewOf(xyz), nullptr, paramsFor(230000));
  ASSERT_EQ(set.planes.size(), 1u);
  EXPECT_NEAR(set.planes[0].plane.offset, 0.0, 0.002);
}

TEST(SequentialPlanes, KeepsPlanesThatMeetAtAnEdge) {
  std::vector<float> xyz;
  Random random(6);
  for (int i = 0; i < 20000; ++i) {
    const double u = random.uniform(0, 2), v = random.uniform(0, 2);
    const double w = 0.003 * random.normal();
    const Vector3 p = i % 2 == 0 ? Vector3(u, v, w) : Vector3(u, w, v);
    for (Eigen::Index axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(p[axis]));
  }
  const PlaneSet set = findPlanes(viewOf(xyz), nullptr, paramsFor(20000));
  ASSERT_EQ(set.planes.size(), 2u);
  // Each gets its own points up to the edge: only ties within the noise may go astray.
  for (const PlaneSegment& segment : set.planes)
    EXPECT_NEAR(static_cast<double>(segment.inliers.size()), 10000.0, 100.0);
}

TEST(SequentialPlanes, ThresholdFollowsTheNoise) {
  // A wall at 8 m seen by a stereo camera: its noise of 10 cm is far more than d_T.
  Random random(7);
  const StereoNoise noise{0.12, 500.0, 0.1};  // dz = 0.107 m at 8 m
  std::vector<float> xyz;
  for (int i = 0; i < 60000; ++i) {
    const double z = 8.0 + noise.depthError(8.0) * random.normal();
    const Vector3 p(random.uniform(-3, 3), random.uniform(-2, 2), z);
    for (Eigen::Index axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(p[axis]));
  }
  MultiPlaneParams params = paramsFor(60000);
  params.min_inliers = 30000;
  params.noise = noise;
  const PlaneSet set = findPlanes(viewOf(xyz), nullptr, params);
  ASSERT_EQ(set.planes.size(), 1u);
  EXPECT_GT(set.planes[0].inliers.size(), 58000u);
  EXPECT_GT(std::abs(set.planes[0].plane.normal.z()), std::cos(0.5 * M_PI / 180.0));
}

TEST(SequentialPlanes, CovarianceShrinksWithThePoints) {
  const test::PlaneScene small = test::makeRoom(60000, 0.1, 0.001, 3, test::RoomKind::Dense);
  const test::PlaneScene large = test::makeRoom(240000, 0.1, 0.001, 3, test::RoomKind::Dense);
  const PlaneSet few = findPlanes(small.view(), nullptr, paramsFor(small.size()));
  const PlaneSet many = findPlanes(large.view(), nullptr, paramsFor(large.size()));
  ASSERT_FALSE(few.planes.empty());
  ASSERT_FALSE(many.planes.empty());
  const double ratio = few.planes[0].covariance.trace() / many.planes[0].covariance.trace();
  EXPECT_NEAR(ratio, 4.0, 1.0);
}

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
