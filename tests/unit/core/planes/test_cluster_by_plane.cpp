// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/planes/multi_plane.h"
#include "plane_scenes.h"

namespace planar_mapping {
namespace {

const Plane kFloor{Vector3::UnitZ(), 0.0};
const Plane kShelf{Vector3::UnitZ(), -0.08};
const Plane kWall{Vector3::UnitX(), -2.0};

std::vector<std::int32_t> cluster(const std::vector<float>& xyz, const std::vector<Plane>& planes,
                                  const MultiPlaneParams& params = {}) {
  return clusterByPlane(PointsView(xyz.data(), xyz.size() / 3), planes, params);
}

TEST(ClusterByPlane, GivesPointsToTheNearestPlaneWithinTheThreshold) {
  // 5 cm from the floor is on it, 3.9 and 4.1 cm lie on either side of the middle to the shelf.
  const std::vector<float> xyz = {1, 1, -0.05f,  1, 1, 0.039f, 1, 1, 0.041f,
                                  1, 1, -0.051f, 1, 1, 0.12f,  2, 5, 7};
  const std::vector<std::int32_t> expected = {0, 0, 1, -1, 1, 2};
  EXPECT_EQ(cluster(xyz, {kFloor, kShelf, kWall}), expected);
}

TEST(ClusterByPlane, IncludesTheBorderOfTheBand) {
  MultiPlaneParams params;
  params.distance_threshold = 0.25;  // exact in binary
  const std::vector<float> xyz = {0, 0, 0.25f, 0, 0, -0.25f, 0, 0, 0.2502f};
  const std::vector<std::int32_t> expected = {0, 0, -1};
  EXPECT_EQ(cluster(xyz, {kFloor}, params), expected);
}

TEST(ClusterByPlane, ThresholdFollowsTheNoiseWithDepth) {
  MultiPlaneParams params;
  params.noise = StereoNoise{0.1, 500.0, 0.5};  // dz = z^2 / 100: 0.09 m at 3 m
  params.noise_factor = 2.0;
  // d_T is 0.05 m at 1 m and 0.18 m at 3 m.
  const std::vector<float> xyz = {2.06f, 0, 1, 2.04f, 0, 1, 2.17f, 0, 3, 2.19f, 0, 3};
  const std::vector<std::int32_t> expected = {-1, 0, 0, -1};
  EXPECT_EQ(cluster(xyz, {kWall}, params), expected);
}

TEST(ClusterByPlane, SkipsPointsThatAreNoMeasurement) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const std::vector<float> xyz = {nan, 0, 0, 1, 0, 0, 0, inf, 0, 0, 0, -inf, 0, 0, 0};
  const std::vector<std::int32_t> expected = {-1, 0, -1, -1, -1};
  EXPECT_EQ(cluster(xyz, {kFloor}), expected);
}

TEST(ClusterByPlane, WithoutPlanesOrPointsNothingIsLabelled) {
  EXPECT_EQ(cluster({1, 2, 3}, {}), std::vector<std::int32_t>{-1});
  EXPECT_TRUE(cluster({}, {kFloor}).empty());
}

TEST(ClusterByPlane, RefusesBadParameters) {
  MultiPlaneParams params;
  params.distance_threshold = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(cluster({0, 0, 0}, {kFloor}, params), ParameterError);
}

TEST(ClusterByPlane, KeepsItsPrecisionFarFromTheOrigin) {
  // 16 km away floats are 1 mm apart: distances must still be right to that.
  const Plane far{Vector3(0.6, 0.0, 0.8), -0.6 * 16000.0 - 0.8 * 4.0};
  std::vector<float> xyz;
  std::vector<std::int32_t> expected;
  Random random(3);
  for (int i = 0; i < 3000; ++i) {
    const Vector3 p(16000.0 + random.uniform(-1, 1), random.uniform(-5, 5),
                    4.0 + random.uniform(-1, 1));
    for (Eigen::Index axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(p[axis]));
    const Vector3 rounded(xyz[xyz.size() - 3], xyz[xyz.size() - 2], xyz[xyz.size() - 1]);
    const double distance = std::abs(far.signedDistance(rounded));
    if (std::abs(distance - 0.05) < 1e-5) {  // on the border either answer will do
      xyz.resize(xyz.size() - 3);
      continue;
    }
    expected.push_back(distance <= 0.05 ? 0 : -1);
  }
  EXPECT_EQ(cluster(xyz, {far}), expected);
}

TEST(ClusterByPlane, AgreesWithBruteForceOnAnyNumberOfThreads) {
  const test::PlaneScene scene = test::makeRoom(5000, 0.3, 0.002, 4, test::RoomKind::Dense);
  MultiPlaneParams params;
  const auto one = clusterByPlane(scene.view(), scene.planes, params);
  params.threads = 4;
  EXPECT_EQ(clusterByPlane(scene.view(), scene.planes, params), one);
  std::size_t different = 0;
  for (std::size_t i = 0; i < scene.size(); ++i) {
    double nearest = params.distance_threshold;
    std::int32_t expected = -1;
    for (std::size_t k = 0; k < scene.planes.size(); ++k) {
      const double d = std::abs(scene.planes[k].signedDistance(scene.view().point(i)));
      if (d > nearest) continue;
      nearest = d;
      expected = static_cast<std::int32_t>(k);
    }
    different += one[i] != expected ? 1 : 0;
  }
  EXPECT_LE(different, 1u);  // a point on a border may round either way
}

}  // namespace
}  // namespace planar_mapping
