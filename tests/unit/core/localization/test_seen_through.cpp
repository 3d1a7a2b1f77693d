// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Scans of all directions in a surface map, and what one of them sees through.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "planar_mapping/localization/registration/seen_through.h"
#include "planar_mapping/localization/registration/surface_map.h"
#include "ring_scan.h"

namespace planar_mapping::detail {
namespace {

PointsView scanOf(const std::vector<float>& xyz) {
  return {xyz.data(), xyz.size() / 3};
}

SurfaceMapParams scannerParams() {
  SurfaceMapParams params = SurfaceMapParams::ofScanner();
  params.cell = 0.4;
  params.reach = 6.0 * params.cell;
  return params;
}

/// Where the second of two scans in a box is found, guessed not to have moved along x.
CloudRegistration secondScan(const Eigen::Array3d& low, const Eigen::Array3d& high, double step,
                             Random& random) {
  const Eigen::Array3d moved(step, 0.0, 0.0);
  SurfaceMapParams params = scannerParams();
  const std::vector<float> before = test::ringScan(low, high, 0.0, params.depth_error, random);
  const std::vector<float> cloud =
      test::ringScan(low - moved, high - moved, 0.0, params.depth_error, random);
  params.cell = surfaceCellFor(scanOf(before), params);
  params.reach = 6.0 * params.cell;
  SurfaceMap map(params);
  map.insert(scanOf(before), Pose::Identity());
  return map.locate(scanOf(cloud), Pose::Identity());
}

/// The rings on floor and walls move with the scanner: nothing near holds it along a corridor of
/// 2.4 x 2.6 m that ends 20 m ahead and 15 m behind.
TEST(SurfaceMap, ACorridorSeenInRingsIsNoStandstill) {
  for (const double step : {0.5, 0.8, 1.6}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      Random random(seed);
      const CloudRegistration found =
          secondScan({-15.0, -1.2, -1.1}, {20.0, 1.2, 1.5}, step, random);
      const double error = std::abs(found.T_world_sensor.translation().x() - step);
      const double deviation = std::sqrt(found.covariance(0, 0));
      EXPECT_TRUE(!found.found || deviation > 0.5 || error < 0.2)
          << error << " of " << step << " m off, taken for right within " << deviation << " m";
    }
  }
}

TEST(SurfaceMap, ARoomSeenInRingsIsFound) {
  constexpr double kStep = 0.5;  // metres
  for (const std::uint64_t seed : {1, 2, 3}) {
    Random random(seed);
    const CloudRegistration found = secondScan({-4.0, -3.0, -1.1}, {3.0, 5.0, 1.9}, kStep, random);
    ASSERT_TRUE(found.found);
    // The rings on the floor move with the scanner and hold it back by 5 to 7 cm.
    EXPECT_LT((found.T_world_sensor.translation() - Vector3(kStep, 0.0, 0.0)).norm(), 0.1);
    EXPECT_LT(std::sqrt(found.covariance(0, 0)), 0.1);
  }
}

/// The error of a camera's depth, which grows with its square, would leave of a yard only what is
/// next to the scanner, where rings say little: it could not be placed where it stood.
TEST(SurfaceMap, AYardSeenInRingsLeavesNothingOpen) {
  for (const double size : {1.5, 2.0}) {
    for (const double step : {0.0, 1.0, 2.0}) {
      Random random(1);
      const CloudRegistration found = secondScan({-12.0 * size, -9.0 * size, -1.7},
                                                 {15.0 * size, 10.0 * size, 8.0}, step, random);
      ASSERT_TRUE(found.found) << size << ", " << step;
      EXPECT_LT((found.T_world_sensor.translation() - Vector3(step, 0.0, 0.0)).norm(), 0.03);
      EXPECT_TRUE(MotionParams().isCertain(found.covariance)) << size << ", " << step;
    }
  }
}

/// What a scanner that looks elsewhere each time sees from inside a box: 20,000 points.
std::vector<float> anyScan(const Eigen::Array3d& low, const Eigen::Array3d& high, double noise,
                           Random& random) {
  std::vector<float> xyz;
  while (xyz.size() < 60000) {
    const Vector3 ray =
        Vector3(random.normal(), random.normal(), 0.5 * random.normal()).normalized();
    const double range =
        (ray.array() > 0.0).select(high / ray.array(), low / ray.array()).minCoeff();
    const Eigen::Vector3f p = (ray * (range + noise * random.normal())).cast<float>();
    xyz.insert(xyz.end(), p.data(), p.data() + 3);
  }
  return xyz;
}

/// A step a scan, from somewhere in the world; each is inserted where it was found. How far the
/// last one is off, metres.
double errorAfter(int scans, double step, std::uint64_t seed) {
  Random random(seed);
  const SurfaceMapParams params = scannerParams();
  SurfaceMap map(params);
  Pose pose(Eigen::AngleAxisd(0.5, Vector3(0.2, 0.1, 1.0).normalized()));
  pose.pretranslate(Vector3(3.3, -1.7, 0.4));
  const Pose first = pose;
  for (int i = 0; i < scans; ++i) {
    const Eigen::Array3d moved(i * step, 0.0, 0.0);
    const std::vector<float> cloud =
        anyScan(Eigen::Array3d(-4.0, -3.0, -1.1) - moved, Eigen::Array3d(9.0, 5.0, 2.9) - moved,
                params.depth_error, random);
    if (i > 0) {
      const CloudRegistration found = map.locate(scanOf(cloud), pose);
      EXPECT_TRUE(found.found) << i;
      pose = found.T_world_sensor;
    }
    map.insert(scanOf(cloud), pose);
  }
  return ((first.inverse() * pose).translation() - Vector3((scans - 1) * step, 0.0, 0.0)).norm();
}

TEST(SurfaceMap, AScannerAtRestStaysWhereItIs) {
  EXPECT_LT(errorAfter(12, 0.0, 1), 1e-9);
  EXPECT_LT(errorAfter(12, 0.0, 2), 1e-9);
  // One that creeps is held back for a twelfth of a cell, 3 cm, at most.
  EXPECT_LT(errorAfter(20, 0.005, 3), 0.05);
}

/// Four people, boxes of 0.6 x 0.6 x 1.8 m, that walk along x through a room, 0.35 m a scan and
/// more, seen by a scanner that stands still.
std::vector<float> peopleScan(int frame, double noise, Random& random) {
  std::vector<float> xyz;
  while (xyz.size() < 60000) {
    const Vector3 ray =
        Vector3(random.normal(), random.normal(), 0.5 * random.normal()).normalized();
    double range = (ray.array() > 0.0)
                       .select(Eigen::Array3d(5.0, 3.0, 1.9) / ray.array(),
                               Eigen::Array3d(-4.0, -4.0, -1.1) / ray.array())
                       .minCoeff();
    for (int i = 0; i < 4; ++i) {
      const double x = std::fmod((0.35 + 0.1 * i) * frame + 2.1 * i, 7.0) - 3.0;
      const Eigen::Array3d middle(x, std::array{1.4, -1.0, -1.6, 2.2}.at(i), -0.2);
      const Eigen::Array3d half(0.3, 0.3, 0.9);
      const Eigen::Array3d a = (middle - half) / ray.array();
      const Eigen::Array3d b = (middle + half) / ray.array();
      const double enter = a.min(b).maxCoeff();
      if (enter > 0.0 && enter < a.max(b).minCoeff()) range = std::min(range, enter);
    }
    const Eigen::Vector3f p = (ray * (range + noise * random.normal())).cast<float>();
    xyz.insert(xyz.end(), p.data(), p.data() + 3);
  }
  return xyz;
}

TEST(SurfaceMap, TrailsOfPeopleDoNotCount) {
  Random random(1);
  const SurfaceMapParams params = scannerParams();
  SurfaceMap map(params);
  for (int frame = 0; frame < 20; ++frame) {
    // Not twice from one place: that would be no new scan.
    const Pose truth(Eigen::Translation3d(0.001 * frame, 0.0, 0.0));
    const std::vector<float> cloud = peopleScan(frame, params.depth_error, random);
    if (frame > 0) {
      const CloudRegistration found = map.locateNear(scanOf(cloud), truth);
      EXPECT_TRUE(found.found) << frame << ", seen through " << found.seen_through;
      EXPECT_LT((found.T_world_sensor.translation() - truth.translation()).norm(), 0.05);
    }
    map.insert(scanOf(cloud), truth);
  }
}

/// A corridor along x without an end in sight, 4 m wide and 3 m high, with a pillar of 0.4 m every
/// 1.5 m on both sides, seen from a scanner at x.
std::vector<float> corridorScan(double x, double noise, Random& random) {
  std::vector<float> xyz;
  while (xyz.size() < 60000) {
    const Vector3 ray =
        Vector3(random.normal(), random.normal(), 0.5 * random.normal()).normalized();
    double range =
        std::min((ray.y() > 0.0 ? 2.0 : -2.0) / ray.y(), (ray.z() > 0.0 ? 1.9 : -1.1) / ray.z());
    for (int i = -14; i <= 14; ++i) {
      const double middle = 1.5 * i - x;
      for (const double side : {-1.8, 1.8}) {
        const Eigen::Array2d a = Eigen::Array2d(middle - 0.2, side - 0.2) / ray.head<2>().array();
        const Eigen::Array2d b = Eigen::Array2d(middle + 0.2, side + 0.2) / ray.head<2>().array();
        const double enter = a.min(b).maxCoeff();
        if (enter > 0.0 && enter < a.max(b).minCoeff()) range = std::min(range, enter);
      }
    }
    if (range > 20.0) continue;
    const Eigen::Vector3f p = (ray * (range + noise * random.normal())).cast<float>();
    xyz.insert(xyz.end(), p.data(), p.data() + 3);
  }
  return xyz;
}

TEST(SurfaceMap, AScanThatFitsTwiceWithinItsReachIsNotPlaced) {
  // A step of one pillar looks like none.
  for (const std::uint64_t seed : {1, 2, 3}) {
    Random random(seed);
    const SurfaceMapParams params = scannerParams();
    SurfaceMap map(params);
    map.insert(scanOf(corridorScan(0.0, params.depth_error, random)), Pose::Identity());
    const std::vector<float> cloud = corridorScan(1.5, params.depth_error, random);
    const CloudRegistration near = map.locateNear(scanOf(cloud), Pose::Identity());
    ASSERT_TRUE(near.found);
    EXPECT_LT(near.T_world_sensor.translation().norm(), 0.3);
    EXPECT_LT(std::sqrt(near.covariance(0, 0)), 0.1);  // held, but at the wrong pillar
    EXPECT_FALSE(map.locateFar(scanOf(cloud), Pose::Identity(), near).found);
  }
}

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
