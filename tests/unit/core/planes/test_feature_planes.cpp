// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/planes/multi_plane.h"
#include "plane_scenes.h"

namespace planar_mapping {
namespace {

KeyFeature featureAt(const Vector3& position) {
  KeyFeature feature;
  feature.position = position;
  return feature;
}

/// Points of a rectangle from \p corner along \p u and \p v, \p step apart.
void addRectangle(test::PlaneScene& scene, const Vector3& corner, const Vector3& u,
                  const Vector3& v, double step, int plane) {
  const int columns = static_cast<int>(u.norm() / step);
  const int rows = static_cast<int>(v.norm() / step);
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column)
      scene.add(corner + u * column / columns + v * row / rows, plane);
  }
}

/// A floor 1 m below the sensor and a wall 3 m ahead of it, y down, z ahead; features on the floor
/// only unless \p on_wall.
struct Corner {
  test::PlaneScene scene;
  std::vector<KeyFeature> features;

  explicit Corner(bool on_wall) {
    scene.planes = {{-Vector3::UnitY(), 1.0}, {-Vector3::UnitZ(), 3.0}};
    addRectangle(scene, {-2, 1, 1}, {4, 0, 0}, {0, 0, 2}, 0.02, 0);
    addRectangle(scene, {-2, -1, 3}, {4, 0, 0}, {0, 1.98, 0}, 0.02, 1);
    Random random(3, 1);
    for (int i = 0; i < 60; ++i) {
      features.push_back(featureAt({random.uniform(-2, 2), 1.0, random.uniform(1, 3)}));
      if (on_wall) features.push_back(featureAt({random.uniform(-2, 2), random.uniform(-1, 1), 3}));
    }
  }
};

MultiPlaneParams smallParams() {
  MultiPlaneParams params;
  params.distance_threshold = 0.03;
  params.source = PlaneSource::Auto;
  return params;
}

TEST(FeaturePlanes, GivesDensePointsToThePlanesOfFeatures) {
  const Corner corner(true);
  MultiPlaneParams params = smallParams();
  params.source = PlaneSource::Features;
  const PlaneSet found = segmentPlanes(corner.scene.view(), nullptr, corner.features, params);
  ASSERT_EQ(found.planes.size(), 2U);
  const test::PlaneScore score = test::scorePlanes(corner.scene, found);
  EXPECT_EQ(score.recall, 1.0);
  EXPECT_LT(score.angle_deg, 0.1);
  EXPECT_GT(score.point_recall, 0.97);
  const FeaturePlaneDiagnostics& diagnostics = found.diagnostics.features;
  EXPECT_EQ(diagnostics.features_considered, 120U);
  EXPECT_EQ(diagnostics.planes_of_features, 2U);
  EXPECT_EQ(diagnostics.points_of_features,
            found.planes[0].inliers.size() + found.planes[1].inliers.size());
}

TEST(FeaturePlanes, DenseSearchFindsThePlainWall) {
  const Corner corner(false);
  MultiPlaneParams params = smallParams();
  params.source = PlaneSource::Features;
  EXPECT_EQ(segmentPlanes(corner.scene.view(), nullptr, corner.features, params).planes.size(), 1U);
  params.source = PlaneSource::Auto;
  const PlaneSet found = segmentPlanes(corner.scene.view(), nullptr, corner.features, params);
  EXPECT_EQ(test::scorePlanes(corner.scene, found).recall, 1.0);
  EXPECT_EQ(found.planes.size(), 2U);
  EXPECT_EQ(found.diagnostics.features.planes_of_dense_points, 1U);
}

TEST(FeaturePlanes, WithoutFeaturesAndSamplesTheDenseSearchDoesAll) {
  const Corner corner(false);
  MultiPlaneParams params = smallParams();
  params.features.samples = 0;
  const PlaneSet found = segmentPlanes(corner.scene.view(), nullptr, {}, params);
  const PlaneSet dense = findPlanes(corner.scene.view(), nullptr, params);
  ASSERT_EQ(found.planes.size(), dense.planes.size());
  for (std::size_t i = 0; i < dense.planes.size(); ++i)
    EXPECT_EQ(found.planes[i].inliers, dense.planes[i].inliers);
  params.source = PlaneSource::Features;
  EXPECT_TRUE(segmentPlanes(corner.scene.view(), nullptr, {}, params).planes.empty());
}

TEST(FeaturePlanes, SampledPointsTakeThePlaceOfFeatures) {
  const Corner corner(false);
  MultiPlaneParams params = smallParams();
  params.source = PlaneSource::Features;
  const PlaneSet found = segmentPlanes(corner.scene.view(), nullptr, {}, params);
  EXPECT_EQ(found.diagnostics.features.features_considered, 1000U);
  EXPECT_EQ(test::scorePlanes(corner.scene, found).recall, 1.0);
}

TEST(FeaturePlanes, NoPlaneThroughUnrelatedObjects) {
  // Features lie on a slanting plane through a stack of shelves, which are surfaces of their own:
  // each shelf is crossed in a narrow strip.
  test::PlaneScene scene;
  std::vector<KeyFeature> features;
  for (int shelf = 0; shelf < 12; ++shelf) {
    const double y = 0.12 * shelf - 0.7;
    addRectangle(scene, {-1, y, 1.5}, {2, 0, 0}, {0, 0, 1.5}, 0.02, shelf);
    for (int k = 0; k < 8; ++k) features.push_back(featureAt({0.25 * k - 0.9, y, 2.25 + y}));
  }
  MultiPlaneParams params = smallParams();
  params.source = PlaneSource::Features;
  const auto slanting = [&](const PlaneSet& set) {
    int number = 0;
    for (const PlaneSegment& segment : set.planes)
      number += std::fabs(segment.plane.normal.y()) < 0.9 ? 1 : 0;
    return number;
  };
  const PlaneSet found = segmentPlanes(scene.view(), nullptr, features, params);
  EXPECT_EQ(slanting(found), 0);
  EXPECT_GE(found.diagnostics.features.planes_of_features, 1U);
  params.features.refine = false;  // as in the paper
  EXPECT_GE(slanting(segmentPlanes(scene.view(), nullptr, features, params)), 1);
}

TEST(FeaturePlanes, RefitsToTheDensePoints) {
  // Features 2 cm off their wall at one end tilt its plane; the dense points set it right.
  Corner corner(false);
  corner.features.clear();
  for (int i = 0; i < 40; ++i) {
    const double x = -2.0 + 0.1 * i;
    corner.features.push_back(featureAt({x, 0.3 * std::sin(1.7 * i), 3.0 + 0.005 * (x + 2.0)}));
  }
  MultiPlaneParams params = smallParams();
  params.source = PlaneSource::Features;
  const PlaneSet refined = segmentPlanes(corner.scene.view(), nullptr, corner.features, params);
  ASSERT_EQ(refined.planes.size(), 1U);
  EXPECT_GT(std::fabs(refined.planes[0].plane.normal.z()), std::cos(1e-3));
  params.features.refine = false;
  const PlaneSet plain = segmentPlanes(corner.scene.view(), nullptr, corner.features, params);
  ASSERT_EQ(plain.planes.size(), 1U);
  EXPECT_NEAR(std::acos(std::fabs(plain.planes[0].plane.normal.z())), 0.005, 0.001);
}

TEST(FeaturePlanes, FindsFarPlanesOfStereoFeatures) {
  // A wall 8 m away, where 0.3 pixels are 0.3 m, and the floor in front of it.
  MultiPlaneParams params = smallParams();
  params.noise = StereoNoise{0.12, 500.0, 0.5};
  params.source = PlaneSource::Features;
  test::PlaneScene scene;
  std::vector<KeyFeature> features;
  Random random(4, 2);
  const auto see = [&](const Vector3& p, double noise) {
    const double disparity = 60.0 / p.z();
    return Vector3(p * (disparity / (disparity + noise * random.normal())));
  };
  for (int i = 0; i < 40000; ++i) {
    const bool floor = i % 4 == 0;
    const Vector3 p = floor ? Vector3(random.uniform(-2, 2), 1.0, random.uniform(2.5, 8))
                            : Vector3(random.uniform(-4, 4), random.uniform(-3, 1), 8.0);
    scene.add(see(p, 0.1), floor ? 0 : 1);
    if (i % 100 < 2) features.push_back(featureAt(see(p, 0.3)));
  }
  scene.planes = {{-Vector3::UnitY(), 1.0}, {-Vector3::UnitZ(), 8.0}};
  const PlaneSet found = segmentPlanes(scene.view(), nullptr, features, params);
  ASSERT_EQ(found.planes.size(), 2U);
  EXPECT_GT(std::fabs(found.planes[0].plane.normal.z()), std::cos(0.05));
  EXPECT_GT(std::fabs(found.planes[1].plane.normal.y()), std::cos(0.05));
  EXPECT_NEAR(std::fabs(found.planes[0].plane.offset), 8.0, 0.2);
}

TEST(FeaturePlanes, OnlyIndexedPointsCount) {
  const Corner corner(true);
  Indices indices;
  for (std::size_t i = 0; i < corner.scene.size(); i += 3) indices.push_back(static_cast<int>(i));
  const PlaneSet found =
      segmentPlanes(corner.scene.view(), &indices, corner.features, smallParams());
  ASSERT_EQ(found.planes.size(), 2U);
  for (const PlaneSegment& segment : found.planes) {
    for (const int i : segment.inliers) EXPECT_EQ(i % 3, 0);
  }
}

TEST(FeaturePlanes, SkipsAndCountsFeaturesThatAreNotFinite) {
  Corner corner(true);
  const PlaneSet clean =
      segmentPlanes(corner.scene.view(), nullptr, corner.features, smallParams());
  corner.features.insert(corner.features.begin() + 7, featureAt({test::kNan, 0, 1}));
  corner.features.push_back(featureAt({0, std::numeric_limits<double>::infinity(), 1}));
  const PlaneSet found =
      segmentPlanes(corner.scene.view(), nullptr, corner.features, smallParams());
  EXPECT_EQ(found.diagnostics.features.features_not_finite, 2U);
  ASSERT_EQ(found.planes.size(), clean.planes.size());
  EXPECT_EQ(found.planes[0].inliers, clean.planes[0].inliers);
}

TEST(FeaturePlanes, HostileInputGivesNoPlaneAndNoCrash) {
  const MultiPlaneParams params = smallParams();
  EXPECT_TRUE(segmentPlanes(PointsView(), nullptr, {}, params).planes.empty());
  const std::vector<float> one = {1, 2, 3};
  const std::vector<KeyFeature> same(20, featureAt({1, 2, 3}));
  EXPECT_TRUE(segmentPlanes(PointsView(one.data(), 1), nullptr, same, params).planes.empty());
  std::vector<KeyFeature> far;
  for (int i = 0; i < 30; ++i) far.push_back(featureAt({1e9 + i, 1e9 * (i % 5), 1e9 - i * i}));
  const std::vector<float> huge(300, 1e9F);
  EXPECT_TRUE(segmentPlanes(PointsView(huge.data(), 100), nullptr, far, params).planes.empty());
  std::vector<KeyFeature> line;
  for (int i = 0; i < 30; ++i) line.push_back(featureAt({0.1 * i, 0.2 * i, 1.0 + 0.1 * i}));
  EXPECT_TRUE(segmentPlanes(PointsView(one.data(), 1), nullptr, line, params).planes.empty());
}

TEST(FeaturePlanes, RejectsParametersOutOfRange) {
  const auto fails = [](auto change) {
    MultiPlaneParams params;
    change(params);
    EXPECT_THROW(params.validate(), ParameterError);
  };
  fails([](MultiPlaneParams& p) { p.features.min_features = 2; });
  fails([](MultiPlaneParams& p) { p.features.feature_error_factor = 0.0; });
  fails([](MultiPlaneParams& p) { p.features.min_dominance = 0.9; });
  fails([](MultiPlaneParams& p) { p.features.max_refit_turn = 0.0; });
  fails([](MultiPlaneParams& p) { p.features.max_refit_turn = 2.0; });
  fails([](MultiPlaneParams& p) { p.features.joining_angle = -0.1; });
  fails([](MultiPlaneParams& p) { p.distance_threshold = -1.0; });
  MultiPlaneParams().validate();
  const Indices outside = {5};
  const std::vector<float> one = {1, 2, 3};
  EXPECT_THROW(segmentPlanes(PointsView(one.data(), 1), &outside, {}, {}), InputError);
}

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
