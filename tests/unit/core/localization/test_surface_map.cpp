// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/registration/surface_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping {
namespace {

constexpr std::uint32_t kColumns = 160;
constexpr std::uint32_t kRows = 120;
constexpr double kFocal = 130.0;

/// A corner of a room with a box in it, as a depth camera sees it: by ray against planes and box.
enum class Scene { Room, Corner, Floor, BoxOnFloor };

std::vector<float> view(const Pose& T_world_sensor, double noise, Random& random,
                        Scene scene = Scene::Room) {
  const Vector3 low(-0.3, 1.2, -0.4);
  const Vector3 high(0.3, 1.8, 0.1);
  std::vector<float> xyz;
  const Vector3 origin = T_world_sensor.translation();
  for (std::uint32_t row = 0; row < kRows; ++row) {
    for (std::uint32_t column = 0; column < kColumns; ++column) {
      const Vector3 ray((column - 0.5 * kColumns) / kFocal, (row - 0.5 * kRows) / kFocal, 1.0);
      const Vector3 direction = T_world_sensor.linear() * ray;
      double best = std::numeric_limits<double>::infinity();
      const auto plane = [&](int axis, double at) {
        const double t = (at - origin[axis]) / direction[axis];
        if (t > 0.0 && t < best) best = t;
      };
      plane(2, -0.4);
      if (scene == Scene::Room || scene == Scene::Corner) {
        plane(1, 3.0);
        plane(0, 1.5);
      }
      if (scene == Scene::Room || scene == Scene::BoxOnFloor) {
        double enter = 0.0;
        double leave = best;
        for (int axis = 0; axis < 3; ++axis) {
          const double a = (low[axis] - origin[axis]) / direction[axis];
          const double b = (high[axis] - origin[axis]) / direction[axis];
          enter = std::max(enter, std::min(a, b));
          leave = std::min(leave, std::max(a, b));
        }
        if (enter > 0.0 && enter < leave) best = enter;
      }
      const double z = best + noise * best * best * random.normal();
      const bool seen = std::isfinite(best) && best < 6.0;
      for (int axis = 0; axis < 3; ++axis)
        xyz.push_back(seen ? static_cast<float>(ray[axis] * z) : test::kNanFloat);
    }
  }
  return xyz;
}

PointsView viewOf(const std::vector<float>& xyz) {
  return {xyz.data(), kColumns, kRows, 3};
}

Pose cameraAt(double x, double y, double z, double yaw, double pitch) {
  Matrix3 axes;  // optical axes, looking along y
  axes << 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0;
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw, Vector3::UnitZ()).toRotationMatrix() * axes *
                  Eigen::AngleAxisd(-pitch, Vector3::UnitX()).toRotationMatrix();
  pose.translation() << x, y, z;
  return pose;
}

SurfaceMapParams testParams() {
  SurfaceMapParams params;
  params.cell = 0.08;
  return params;
}

const Pose kFirst = cameraAt(0.0, 0.0, 0.5, 0.0, 0.35);

TEST(SurfaceMap, FindsTheCloudItWasMadeOf) {
  Random random;
  const auto cloud = view(kFirst, 0.001, random);
  SurfaceMap map(testParams());
  map.insert(viewOf(cloud), kFirst);
  EXPECT_GT(map.cells(), 100u);
  const CloudRegistration found = map.locate(viewOf(cloud), kFirst);
  ASSERT_TRUE(found.found);
  EXPECT_GT(found.matched, found.planes * 9 / 10);
  EXPECT_LT(motionDifference(found.T_world_sensor, kFirst).norm(), 5e-3);
}

TEST(SurfaceMap, FindsAMovedCamera) {
  Random random(2);
  SurfaceMap map(testParams());
  map.insert(viewOf(view(kFirst, 0.001, random)), kFirst);
  for (const Pose& truth :
       {cameraAt(0.1, 0.05, 0.55, 0.05, 0.35), cameraAt(-0.15, 0.1, 0.45, -0.1, 0.4),
        cameraAt(0.0, 0.0, 0.5, 0.14, 0.3)}) {
    const auto cloud = view(truth, 0.001, random);
    const CloudRegistration found = map.locate(viewOf(cloud), kFirst);
    ASSERT_TRUE(found.found);
    const Vector6 error = motionDifference(truth.inverse(), found.T_world_sensor.inverse());
    EXPECT_LT(error.head<3>().norm(), 0.02);
    EXPECT_LT(error.tail<3>().norm(), 0.01);
  }
}

TEST(SurfaceMap, FindsALargeTurnByTheFewPlanesThatTell) {
  // Nearly all of the view is floor, which says nothing about the turn about the vertical; only the
  // edges of the box hold the camera sideways.
  const Pose first = cameraAt(0.0, 0.0, 0.5, 0.0, 0.5);
  int right = 0;
  for (const int seed : {1, 2, 3, 4}) {
    Random random(static_cast<std::uint64_t>(seed));
    SurfaceMap map(testParams());
    map.insert(viewOf(view(first, 0.002, random, Scene::BoxOnFloor)), first);
    for (const double turn : {-0.25, -0.2, 0.2, 0.25}) {
      const Pose truth = cameraAt(0.2 * turn, 0.05, 0.5, turn, 0.5);
      const auto cloud = view(truth, 0.002, random, Scene::BoxOnFloor);
      const CloudRegistration found = map.locate(viewOf(cloud), first);
      ASSERT_TRUE(found.found);
      EXPECT_GT(found.fraction, 0.5);
      const Vector6 error = motionDifference(truth.inverse(), found.T_world_sensor.inverse());
      EXPECT_LT(error.tail<3>().norm(), 0.03);
      if (error.head<3>().norm() < 0.03) ++right;
    }
  }
  EXPECT_GE(right, 15);  // of 16
}

TEST(SurfaceMap, CovarianceIsLargeWhereTheCloudSaysNothing) {
  // Over a bare floor nothing holds the camera sideways, nor its turn about the vertical.
  Random random(3);
  const auto cloud = view(kFirst, 0.0003, random, Scene::Floor);
  SurfaceMap map(testParams());
  map.insert(viewOf(cloud), kFirst);
  const CloudRegistration found = map.locate(viewOf(cloud), kFirst);
  const Matrix3 R = kFirst.linear();
  const Matrix3 in_world = R * found.covariance.topLeftCorner<3, 3>() * R.transpose();
  EXPECT_GT(std::sqrt(in_world(0, 0)), 0.5);
  EXPECT_GT(std::sqrt(in_world(1, 1)), 0.5);
  EXPECT_LT(std::sqrt(in_world(2, 2)), 0.2);
  const Matrix3 turns = R * found.covariance.bottomRightCorner<3, 3>() * R.transpose();
  EXPECT_GT(std::sqrt(turns(2, 2)), 0.2);
  EXPECT_LT(std::sqrt(turns(0, 0)), 0.05);
}

TEST(SurfaceMap, EdgesHoldWhatPlanesLeaveFree) {
  Random random(4);
  SurfaceMap with_edges(testParams());
  SurfaceMap without_edges(testParams());
  const auto cloud = view(kFirst, 0.001, random);
  const PointsView without_rows(cloud.data(), cloud.size() / 3);  // and so without edges
  with_edges.insert(viewOf(cloud), kFirst);
  without_edges.insert(without_rows, kFirst);
  EXPECT_LT(with_edges.locate(viewOf(cloud), kFirst).covariance.trace(),
            without_edges.locate(without_rows, kFirst).covariance.trace());
}

TEST(SurfaceMap, DoesNotFindWhatItHasNotSeen) {
  Random random(5);
  SurfaceMap map(testParams());
  const auto cloud = view(kFirst, 0.001, random);
  EXPECT_FALSE(map.locate(viewOf(cloud), kFirst).found);
  map.insert(viewOf(cloud), kFirst);
  Pose elsewhere = kFirst;
  elsewhere.translation() += Vector3(20.0, 20.0, 20.0);
  EXPECT_FALSE(map.locate(viewOf(cloud), elsewhere).found);
}

const Pose kMoved = cameraAt(0.1, 0.05, 0.55, 0.05, 0.35);
/// Where from kMoved is out of reach: 2 m away and turned by a quarter.
const Pose kWrongGuess = cameraAt(-1.7, -0.9, 0.5, 1.6, 0.35);

TEST(SurfaceMap, LooksFartherAroundWhereTheGuessIsWrong) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    Random random(seed);
    SurfaceMap map(testParams());
    SurfaceMapParams near_params = testParams();
    near_params.search_reach = 0.0;
    SurfaceMap near_only(near_params);
    const auto before = view(kFirst, 0.001, random);
    map.insert(viewOf(before), kFirst);
    near_only.insert(viewOf(before), kFirst);
    const auto cloud = view(kMoved, 0.001, random);
    const CloudRegistration found = map.locate(viewOf(cloud), kWrongGuess);
    ASSERT_TRUE(found.found) << seed;
    const Vector6 error = motionDifference(kMoved.inverse(), found.T_world_sensor.inverse());
    EXPECT_LT(error.head<3>().norm(), 0.02);
    EXPECT_LT(error.tail<3>().norm(), 0.01);
    EXPECT_LT(found.seen_through, 0.05);
    EXPECT_FALSE(near_only.locate(viewOf(cloud), kWrongGuess).found);
  }
}

TEST(SurfaceMap, APlaceThatWasFoundHasToBeTheBestOfAll) {
  Random random(1);
  SurfaceMap map(testParams());
  map.insert(viewOf(view(kFirst, 0.001, random)), kFirst);
  const auto cloud = view(kMoved, 0.001, random);
  CloudRegistration wrong;
  wrong.found = true;
  wrong.T_world_sensor = kWrongGuess;
  const double fraction = map.locate(viewOf(cloud), kWrongGuess).fraction;
  ASSERT_GT(fraction, 0.1);
  wrong.fraction = 0.5 * fraction;
  const CloudRegistration best = map.locateFar(viewOf(cloud), kWrongGuess, wrong);
  ASSERT_TRUE(best.found);
  EXPECT_LT(motionDifference(kMoved.inverse(), best.T_world_sensor.inverse()).norm(), 0.03);
  wrong.fraction = fraction;  // as good
  EXPECT_FALSE(map.locateFar(viewOf(cloud), kWrongGuess, wrong).found);
}

/// Next to the guess floor and walls are enough to tell where more fits.
TEST(SurfaceMap, BesideAPlaceWhereLittleFitsTheOneWhereMoreDoesIsTaken) {
  Random random(8);
  SurfaceMap map(testParams());
  map.insert(viewOf(view(kFirst, 0.001, random, Scene::Corner)), kFirst);
  const Pose moved = cameraAt(0.1, 0.05, 0.5, 0.1, 0.35);
  const auto cloud = view(moved, 0.001, random, Scene::Corner);
  CloudRegistration wrong;
  wrong.found = true;
  wrong.T_world_sensor = cameraAt(0.22, 0.05, 0.5, 0.1, 0.35);
  wrong.fraction = 0.3;
  const CloudRegistration best = map.locateFar(viewOf(cloud), kFirst, wrong);
  ASSERT_TRUE(best.found);
  EXPECT_LT(motionDifference(moved.inverse(), best.T_world_sensor.inverse()).norm(), 0.03);
}

TEST(SurfaceMap, DoesNotGuessAmongCornersThatLookAlike) {
  // Floor and two walls fix a place, but a map of one corner fits any other.
  Random random(8);
  SurfaceMap map(testParams());
  map.insert(viewOf(view(kFirst, 0.001, random, Scene::Corner)), kFirst);
  EXPECT_FALSE(map.locate(viewOf(view(kMoved, 0.001, random, Scene::Corner)), kWrongGuess).found);
}

TEST(SurfaceMap, RefusesWhatSeesThroughTheMap) {
  Random random(9);
  SurfaceMapParams strict = testParams();
  strict.max_seen_through = 0.04;
  SurfaceMapParams trusting = testParams();
  trusting.max_seen_through = 1.0;
  const Pose close = cameraAt(0.2, 0.4, 0.3, 0.0, 0.2);
  const auto full = view(close, 0.001, random);
  const auto bare = view(close, 0.001, random, Scene::Corner);
  // The box was there and its place is seen through, or free before and now filled.
  for (const auto& [before, now] : {std::pair(full, bare), std::pair(bare, full)}) {
    SurfaceMap map(strict);
    SurfaceMap other(trusting);
    map.insert(viewOf(before), close);
    other.insert(viewOf(before), close);
    const CloudRegistration believed = other.locate(viewOf(now), close);
    EXPECT_TRUE(believed.found);
    EXPECT_GT(believed.seen_through, 0.05);
    EXPECT_FALSE(map.locate(viewOf(now), close).found);
  }
}

TEST(SurfaceMap, WhereTheNearPlaceIsContradictedAnotherHasToFitBetter) {
  Random random(9);
  SurfaceMap map(testParams());
  map.insert(viewOf(view(kFirst, 0.001, random)), kFirst);
  const auto cloud = view(kMoved, 0.001, random);
  CloudRegistration near = map.locateNear(viewOf(cloud), kWrongGuess);
  ASSERT_FALSE(near.found);
  const CloudRegistration far = map.locateFar(viewOf(cloud), kWrongGuess, near);
  ASSERT_TRUE(far.found);
  near.fraction = far.fraction / 1.15;
  EXPECT_TRUE(map.locateFar(viewOf(cloud), kWrongGuess, near).found);
  near.fraction = far.fraction / 1.05;
  EXPECT_FALSE(map.locateFar(viewOf(cloud), kWrongGuess, near).found);
}

TEST(SurfaceCellFor, FollowsTheSpacingOfThePoints) {
  const SurfaceMapParams params;
  // A room's walls by rings of a scanner, 128 of them or 16.
  const auto scan = [](int rings) {
    std::vector<float> xyz;
    for (int ring = 0; ring < rings; ++ring) {
      const double up = (ring + 0.5) / rings - 0.5;
      for (int column = 0; column < 2000; ++column) {
        const double turn = column * M_PI / 1000.0;
        const Vector3 ray(std::cos(turn), std::sin(turn), up);
        const double range = 1.0 / std::max(std::abs(ray.x()), std::abs(ray.y()));
        for (int axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(range * ray[axis]));
      }
    }
    return xyz;
  };
  const auto fine = scan(128);
  const auto sparse = scan(16);
  EXPECT_EQ(params.cell, surfaceCellFor(PointsView(fine.data(), fine.size() / 3), params));
  EXPECT_EQ(2.0 * params.cell,
            surfaceCellFor(PointsView(sparse.data(), sparse.size() / 3), params));
  EXPECT_EQ(16.0 * params.cell, surfaceCellFor(PointsView(), params));
  SurfaceMapParams bad;
  bad.cell = -1.0;
  EXPECT_THROW(surfaceCellFor(PointsView(), bad), ParameterError);
}

TEST(SurfaceMap, IsDeterministicAndCopyable) {
  Random random(6);
  SurfaceMap map(testParams());
  map.insert(viewOf(view(kFirst, 0.002, random)), kFirst);
  const auto cloud = view(cameraAt(0.1, 0.0, 0.5, 0.05, 0.35), 0.002, random);
  SurfaceMap copy = map;
  const CloudRegistration a = map.locate(viewOf(cloud), kFirst);
  const CloudRegistration b = copy.locate(viewOf(cloud), kFirst);
  EXPECT_EQ(a.T_world_sensor.matrix(), b.T_world_sensor.matrix());
  EXPECT_EQ(a.matched, b.matched);
  copy.insert(viewOf(cloud), a.T_world_sensor);
  EXPECT_GT(copy.cells(), map.cells());
}

TEST(SurfaceMap, IsBounded) {
  Random random(7);
  SurfaceMapParams params = testParams();
  params.max_cells = 1000;
  SurfaceMap map(params);
  const auto cloud = view(kFirst, 0.001, random);
  for (int i = 0; i < 20; ++i) {
    Pose pose = kFirst;
    pose.translation().x() += 2.0 * i;
    map.insert(viewOf(cloud), pose);
    EXPECT_LE(map.cells(), 3000u);  // the limit and what one cloud adds
  }
}

TEST(SurfaceMap, TakesAnyCloud) {
  SurfaceMap map(testParams());
  map.insert(PointsView(), kFirst);
  EXPECT_EQ(map.cells(), 0u);
  const std::vector<float> hostile = {
      test::kNanFloat, 0, 0, 0, 0, 0, 1e30F, 1e30F, 1, 1, 1, 1e9F, 1e9F, 1e9F, 1, 1, 1, 1};
  map.insert(PointsView(hostile.data(), hostile.size() / 3), kFirst);
  EXPECT_FALSE(map.locate(PointsView(hostile.data(), hostile.size() / 3), kFirst).found);
  EXPECT_FALSE(map.locate(PointsView(), kFirst).found);
  // Points on a line and one point many times have no plane.
  std::vector<float> line;
  for (int i = 0; i < 500; ++i) line.insert(line.end(), {0.001F * static_cast<float>(i), 0, 1});
  std::vector<float> same;
  for (int i = 0; i < 500; ++i) same.insert(same.end(), {1, 1, 1});
  for (const auto& cloud : {line, same}) {
    SurfaceMap other(testParams());
    other.insert(PointsView(cloud.data(), cloud.size() / 3), Pose::Identity());
    EXPECT_FALSE(other.locate(PointsView(cloud.data(), cloud.size() / 3), Pose::Identity()).found);
  }
}

TEST(SurfaceMap, RefusesBadParametersAndPoses) {
  const auto refused = [](auto change) {
    SurfaceMapParams params;
    change(params);
    EXPECT_THROW(SurfaceMap{params}, ParameterError);
  };
  refused([](SurfaceMapParams& p) { p.cell = 0.0; });
  refused([](SurfaceMapParams& p) { p.depth_error = p.depth_error_growth = 0.0; });
  refused([](SurfaceMapParams& p) { p.reach = 0.0; });
  refused([](SurfaceMapParams& p) { p.min_fraction = -0.1; });
  refused([](SurfaceMapParams& p) { p.max_seen_through = 1.5; });
  refused([](SurfaceMapParams& p) { p.search_reach = -1.0; });
  refused([](SurfaceMapParams& p) { p.max_cells = 10; });
  refused([](SurfaceMapParams& p) { p.optical_axis.x() = test::kNanFloat; });
  SurfaceMap map;
  Pose bad = Pose::Identity();
  bad.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(map.insert(PointsView(), bad), InputError);
  EXPECT_THROW(map.locate(PointsView(), bad), InputError);
}

}  // namespace
}  // namespace planar_mapping
