// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/planes/multi_plane.h"
#include "plane_scenes.h"
#include "ring_scan.h"

namespace planar_mapping {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();

/// An even grid of side x side points on z = height with corner (x0, y0), 2 cm apart.
void addSquare(std::vector<float>& xyz, int side, float x0, float y0, float height) {
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      xyz.insert(xyz.end(),
                 {x0 + 0.02f * static_cast<float>(i), y0 + 0.02f * static_cast<float>(j), height});
    }
  }
}

PointsView viewOf(const std::vector<float>& xyz) {
  return {xyz.data(), xyz.size() / 3};
}

class MultiPlane : public testing::TestWithParam<PlaneSearchMethod> {
 protected:
  MultiPlane() {
    params_.method = GetParam();
    params_.min_inliers = 50;
  }
  PlaneSet find(const std::vector<float>& xyz) const {
    return findPlanes(viewOf(xyz), nullptr, params_);
  }
  MultiPlaneParams params_;
};
INSTANTIATE_TEST_SUITE_P(Searches, MultiPlane,
                         testing::Values(PlaneSearchMethod::MultiRansac,
                                         PlaneSearchMethod::Sequential,
                                         PlaneSearchMethod::Automatic));

TEST_P(MultiPlane, FindsASquareExactly) {
  std::vector<float> xyz;
  addSquare(xyz, 40, 1.0f, -2.0f, 3.0f);
  const PlaneSet set = find(xyz);
  ASSERT_EQ(set.planes.size(), 1u);
  const PlaneSegment& plane = set.planes[0];
  EXPECT_EQ(plane.inliers.size(), 1600u);
  EXPECT_TRUE(std::is_sorted(plane.inliers.begin(), plane.inliers.end()));
  // Above the sensor at the origin: the normal looks down to it.
  EXPECT_NEAR(plane.plane.normal.z(), -1.0, 1e-9);
  EXPECT_NEAR(plane.plane.offset, 3.0, 1e-6);
  EXPECT_NEAR(plane.rms, 0.0, 1e-6);
  EXPECT_NEAR(plane.tilt, 0.0, 1e-6);
  EXPECT_EQ(plane.number_of_patches, 1);
  EXPECT_TRUE(plane.patches.empty());
  EXPECT_NEAR(plane.moments.weight(), 1600.0, 1e-9);
  EXPECT_NEAR(plane.moments.mean().x(), 1.0 + 0.02 * 19.5, 1e-5);
}

TEST_P(MultiPlane, NormalsLookTowardsTheSensor) {
  std::vector<float> xyz;
  addSquare(xyz, 40, 0.0f, 0.0f, 3.0f);
  const PlaneSet set = findPlanes(viewOf(xyz), nullptr, params_, Vector3(0, 0, 10));
  ASSERT_EQ(set.planes.size(), 1u);
  EXPECT_NEAR(set.planes[0].plane.normal.z(), 1.0, 1e-9);
}

TEST_P(MultiPlane, SeparatesPatchesOfOnePlane) {
  std::vector<float> xyz;
  addSquare(xyz, 40, 0.0f, 0.0f, 1.0f);
  addSquare(xyz, 30, 2.0f, 0.0f, 1.0f);
  const PlaneSet set = find(xyz);
  ASSERT_EQ(set.planes.size(), 1u);
  ASSERT_EQ(set.planes[0].number_of_patches, 2);
  const auto& patches = set.planes[0].patches;
  ASSERT_EQ(patches.size(), 2500u);
  EXPECT_EQ(std::count(patches.begin(), patches.end(), 0), 1600);
  EXPECT_EQ(std::count(patches.begin(), patches.end(), 1), 900);
  EXPECT_EQ(patches.front(), 0);
  params_.patch_gap = 3.0;
  EXPECT_EQ(find(xyz).planes.at(0).number_of_patches, 1);
}

TEST_P(MultiPlane, PlanesComeLargestFirstAndDisjoint) {
  const test::PlaneScene scene = test::makeRoom(80000, 0.2, 0.001, 9, test::RoomKind::Dense);
  params_.min_inliers = 1500;
  const PlaneSet set = findPlanes(scene.view(), nullptr, params_);
  ASSERT_EQ(set.planes.size(), 6u);
  std::vector<int> all;
  for (std::size_t k = 0; k < 6; ++k) {
    const PlaneSegment& segment = set.planes[k];
    if (k > 0) {
      EXPECT_LE(segment.inliers.size(), set.planes[k - 1].inliers.size());
    }
    EXPECT_GE(segment.inliers.size(), 1500u);
    EXPECT_GE(segment.plane.offset, 0.0);  // towards the sensor at the origin
    for (const int i : segment.inliers) {
      const Vector3 p = scene.view().point(static_cast<std::size_t>(i));
      ASSERT_LE(std::abs(segment.plane.signedDistance(p)), params_.distance_threshold + 1e-12);
      all.push_back(i);
    }
  }
  std::sort(all.begin(), all.end());
  EXPECT_EQ(std::adjacent_find(all.begin(), all.end()), all.end());
}

TEST_P(MultiPlane, ThreadsNeverChangeTheResult) {
  const test::PlaneScene scene = test::makeRoom(20000, 0.3, 0.0015, 5, test::RoomKind::Dense);
  params_.min_inliers = 200;
  const PlaneSet one = findPlanes(scene.view(), nullptr, params_);
  params_.threads = 3;
  const PlaneSet three = findPlanes(scene.view(), nullptr, params_);
  ASSERT_EQ(one.planes.size(), three.planes.size());
  for (std::size_t k = 0; k < one.planes.size(); ++k) {
    EXPECT_EQ(one.planes[k].inliers, three.planes[k].inliers);
    EXPECT_EQ(one.planes[k].plane.normal, three.planes[k].plane.normal);
    EXPECT_EQ(one.planes[k].plane.offset, three.planes[k].plane.offset);
    EXPECT_EQ(one.planes[k].patches, three.planes[k].patches);
  }
}

TEST_P(MultiPlane, SubsetByIndexIsSubsetByCopy) {
  const test::PlaneScene scene = test::makeRoom(8000, 0.3, 0.0015, 6, test::RoomKind::Dense);
  params_.min_inliers = 100;
  Indices subset;
  std::vector<float> copy;
  for (std::size_t i = 0; i < scene.size(); ++i) {
    if (i % 3 == 0) continue;
    subset.push_back(static_cast<int>(i));
    copy.insert(copy.end(), scene.view()[i], scene.view()[i] + 3);
  }
  const PlaneSet by_copy = find(copy);
  Indices shuffled = subset;
  std::reverse(shuffled.begin(), shuffled.end());
  shuffled.push_back(shuffled.front());
  for (const Indices& indices : {subset, shuffled}) {
    const PlaneSet by_index = findPlanes(scene.view(), &indices, params_);
    ASSERT_EQ(by_index.planes.size(), by_copy.planes.size());
    ASSERT_FALSE(by_index.planes.empty());
    for (std::size_t k = 0; k < by_index.planes.size(); ++k) {
      Indices expected;
      for (const int i : by_copy.planes[k].inliers)
        expected.push_back(subset[static_cast<std::size_t>(i)]);
      EXPECT_EQ(by_index.planes[k].inliers, expected);
      EXPECT_EQ(by_index.planes[k].plane.normal, by_copy.planes[k].plane.normal);
    }
  }
}

TEST_P(MultiPlane, SkipsAndCountsPointsThatAreNotFinite) {
  std::vector<float> xyz;
  addSquare(xyz, 30, 0.0f, 0.0f, 1.0f);
  for (int i = 0; i < 20; ++i) xyz.insert(xyz.begin(), {test::kNanFloat, 0.0f, kInf});
  xyz.insert(xyz.end(), {0.0f, -kInf, 1.0f});
  const PlaneSet set = find(xyz);
  ASSERT_EQ(set.planes.size(), 1u);
  EXPECT_EQ(set.planes[0].inliers.size(), 900u);
  EXPECT_EQ(set.planes[0].inliers.front(), 20);
  EXPECT_EQ(set.diagnostics.points_not_measured, 21u);
  EXPECT_EQ(set.diagnostics.points_considered, 921u);
}

TEST_P(MultiPlane, FindsNothingInDegenerateClouds) {
  EXPECT_TRUE(find({}).planes.empty());
  EXPECT_TRUE(find({1.0f, 2.0f, 3.0f}).planes.empty());
  EXPECT_TRUE(find(std::vector<float>(3000, test::kNanFloat)).planes.empty());
  EXPECT_TRUE(find(std::vector<float>(3000, 1.5f)).planes.empty());  // one point 1,000 times
  std::vector<float> line;
  for (int i = 0; i < 500; ++i) {
    const auto t = static_cast<float>(i) * 0.01f;
    line.insert(line.end(), {t, 2.0f * t, -t});
  }
  EXPECT_TRUE(find(line).planes.empty());
}

TEST_P(MultiPlane, FindsNothingInNoise) {
  Random random(8);
  std::vector<float> xyz;
  for (int i = 0; i < 3 * 1000; ++i) xyz.push_back(static_cast<float>(random.uniform(-3, 3)));
  params_.min_inliers = 20;
  const PlaneSet set = find(xyz);
  EXPECT_TRUE(set.planes.empty());
  EXPECT_TRUE(set.diagnostics.stopped_by_itself);
}

TEST_P(MultiPlane, AFarPointChangesNothing) {
  std::vector<float> xyz;
  addSquare(xyz, 40, 0.0f, 0.0f, 1.0f);
  for (const float far : {1e9f, -1e9f, 3e38f, -3e38f}) xyz.insert(xyz.end(), {far, far, far});
  const PlaneSet set = find(xyz);
  ASSERT_EQ(set.planes.size(), 1u);
  EXPECT_EQ(set.planes[0].inliers.size(), 1600u);
  EXPECT_NEAR(std::abs(set.planes[0].plane.normal.z()), 1.0, 1e-6);
}

TEST_P(MultiPlane, SurvivesHugeCoordinates) {
  Random random(2);
  std::vector<float> xyz;
  for (int i = 0; i < 3 * 1000; ++i) xyz.push_back(static_cast<float>(random.uniform(-1e9, 1e9)));
  for (int i = 0; i < 300; ++i) xyz.push_back(i % 2 == 0 ? 3e38f : -3e38f);
  EXPECT_NO_THROW(find(xyz));
}

TEST_P(MultiPlane, DuplicatePointsMakeNoDegeneratePlane) {
  std::vector<float> xyz;
  addSquare(xyz, 30, 0.0f, 0.0f, 1.0f);
  const std::vector<float> once = xyz;
  xyz.insert(xyz.end(), once.begin(), once.end());
  const PlaneSet set = find(xyz);
  ASSERT_EQ(set.planes.size(), 1u);
  EXPECT_EQ(set.planes[0].inliers.size(), 1800u);
  EXPECT_TRUE(set.planes[0].plane.normal.allFinite());
}

TEST_P(MultiPlane, StopsAtMaxPlanes) {
  const test::PlaneScene scene = test::makeRoom(80000, 0.2, 0.001, 9, test::RoomKind::Dense);
  params_.min_inliers = 1500;
  params_.max_planes = 2;
  const PlaneSet set = findPlanes(scene.view(), nullptr, params_);
  EXPECT_EQ(set.planes.size(), 2u);
  EXPECT_FALSE(set.diagnostics.stopped_by_itself);
}

TEST_P(MultiPlane, MovesWithTheCloud) {
  const test::PlaneScene scene = test::makeRoom(60000, 0.1, 0.0005, 3, test::RoomKind::Dense);
  params_.min_inliers = 1500;
  Pose T = Pose::Identity();
  T.linear() = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  T.translation() = Vector3(3, -2, 1);
  std::vector<float> moved;
  for (std::size_t i = 0; i < scene.size(); ++i) {
    const Vector3 p = T * scene.view().point(i);
    for (Eigen::Index axis = 0; axis < 3; ++axis) moved.push_back(static_cast<float>(p[axis]));
  }
  const PlaneSet before = findPlanes(scene.view(), nullptr, params_);
  const PlaneSet after = findPlanes(viewOf(moved), nullptr, params_, T.translation());
  ASSERT_EQ(before.planes.size(), 6u);
  ASSERT_EQ(after.planes.size(), 6u);
  for (const PlaneSegment& segment : before.planes) {
    const Plane expected = transformed(segment.plane, T);
    double best = 0.0;
    for (const PlaneSegment& other : after.planes) {
      if (std::abs(other.plane.offset - expected.offset) > 0.02) continue;
      best = std::max(best, other.plane.normal.dot(expected.normal));
    }
    EXPECT_GT(best, std::cos(0.2 * M_PI / 180.0));
  }
}

TEST(MultiPlaneErrors, RefusesIndicesOutsideTheCloud) {
  const std::vector<float> xyz = {0, 0, 0, 1, 1, 1};
  for (const Indices& indices : {Indices{0, 2}, Indices{-1}})
    EXPECT_THROW(findPlanes(viewOf(xyz), &indices, {}), InputError);
}

TEST(MultiPlaneErrors, RefusesViewsAndSensorsThatCannotBe) {
  const std::vector<float> xyz = {0, 0, 0, 1, 1, 1};
  PointsView view = viewOf(xyz);
  EXPECT_THROW(findPlanes(view, nullptr, {}, Vector3(test::kNanFloat, 0, 0)), InputError);
  view.stride = 2;
  EXPECT_THROW(findPlanes(view, nullptr, {}), InputError);
  view = viewOf(xyz);
  view.data = nullptr;
  EXPECT_THROW(findPlanes(view, nullptr, {}), InputError);
  MultiPlaneParams params;  // all ranges: Parameters.MultiPlaneSACSegmentation of tests/contract
  params.min_inliers = 2;
  EXPECT_THROW(findPlanes(viewOf(xyz), nullptr, params), ParameterError);
}

TEST(MultiPlaneAutomatic, ChoosesByNumberOfPoints) {
  std::vector<float> xyz;
  addSquare(xyz, 30, 0.0f, 0.0f, 1.0f);
  EXPECT_EQ(findPlanes(viewOf(xyz), nullptr, {}).diagnostics.method,
            PlaneSearchMethod::MultiRansac);
  xyz.clear();
  addSquare(xyz, 80, 0.0f, 0.0f, 1.0f);
  EXPECT_EQ(findPlanes(viewOf(xyz), nullptr, {}).diagnostics.method, PlaneSearchMethod::Organized)
      << "its points are pixels of an image";
  Indices few(500);
  std::iota(few.begin(), few.end(), 0);
  EXPECT_EQ(findPlanes(viewOf(xyz), &few, {}).diagnostics.method, PlaneSearchMethod::MultiRansac);
  const PointsView image(xyz.data(), 80u, 80u, 3);
  EXPECT_EQ(findPlanes(image, nullptr, {}).diagnostics.method, PlaneSearchMethod::Organized);
  // Rows whose neighbours are none in space.
  addSquare(xyz, 80, 0.0f, 0.0f, 2.0f);
  const PointsView two = viewOf(xyz);
  EXPECT_EQ(findPlanes(two, nullptr, {}).diagnostics.method, PlaneSearchMethod::Sequential)
      << "two points in some pixels";
  std::vector<float> mixed;
  for (std::size_t i = 0; i < two.size; ++i)
    for (int k = 0; k < 3; ++k) mixed.push_back(two.point(i * 5003 % two.size)[k]);
  const PlaneSet found = findPlanes({mixed.data(), 160u, 80u, 3}, nullptr, {});
  EXPECT_EQ(found.diagnostics.method, PlaneSearchMethod::Sequential);
  EXPECT_EQ(found.planes.size(), 2u);
}

/// What 16 rings of a scanner see of a hall of 24 x 16 x 6.5 m: 0.6 m apart on its walls.
TEST(MultiPlaneAutomatic, RingsOfAScannerAreSurfaces) {
  Random random(7);
  const std::vector<float> xyz =
      test::ringScan({-12.0, -8.0, -1.5}, {12.0, 8.0, 5.0}, 0.4, 0.015, random);
  const PlaneSet found = findPlanes(viewOf(xyz), nullptr, {});
  EXPECT_EQ(found.diagnostics.method, PlaneSearchMethod::Sequential);
  // As some drivers write them, in rows of packets.
  const PointsView packets(xyz.data(), 450u, 64u, 3);
  EXPECT_EQ(findPlanes(packets, nullptr, {}).diagnostics.method, PlaneSearchMethod::Sequential);
  std::size_t on_planes = 0;
  for (const PlaneSegment& segment : found.planes) on_planes += segment.inliers.size();
  EXPECT_GE(found.planes.size(), 5u);
  EXPECT_GT(on_planes, xyz.size() / 3 * 8 / 10);
}

/// The noise of its ranges makes a ring wide, but a plane of ring and rays is no surface. (19 to 33
/// planes of these scans were such.)
TEST(MultiPlaneAutomatic, ARingIsNoPlane) {
  for (const double noise : {0.01, 0.02, 0.03}) {
    Random random(11);
    const std::vector<float> xyz =
        test::ringScan({-6.0, -4.0, -0.9}, {4.0, 4.0, 1.9}, 0.3, noise, random);
    const PlaneSet found = findPlanes(viewOf(xyz), nullptr, {});
    const Matrix3 turn = Eigen::AngleAxisd(-0.3, Vector3::UnitZ()).toRotationMatrix();
    int sides = 0, others = 0;
    for (const PlaneSegment& one : found.planes) {
      const Vector3 normal = turn * one.plane.normal;
      const bool is_wall = normal.head<2>().cwiseAbs().maxCoeff() > std::cos(0.1);
      const double height = -one.plane.offset / normal.z();
      const bool is_level = std::abs(normal.z()) > std::cos(0.1) &&
                            std::min(std::abs(height + 0.9), std::abs(height - 1.9)) < 0.1;
      ++(is_wall || is_level ? sides : others);
    }
    EXPECT_GE(sides, 4) << noise;
    EXPECT_LE(others, 2) << noise;
  }
}

/// Sparse points on the walls of a room, and a third of them anywhere in it, show no surface.
TEST(MultiPlaneAutomatic, SparseFeaturesAmongClutterAreNotLost) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-1.0f, 1.0f);
  std::vector<float> xyz;
  for (int i = 0; i < 6000; ++i) {
    std::array<float, 3> p = {place(random), place(random), place(random)};
    if (i % 3 != 0) p[static_cast<std::size_t>(i / 3 % 3)] = i % 2 == 0 ? 1.0f : -1.0f;
    xyz.insert(xyz.end(), {4.0f * p[0], 3.0f * p[1], 2.0f * p[2]});
  }
  const PlaneSet found = findPlanes(viewOf(xyz), nullptr, {});
  EXPECT_EQ(found.diagnostics.method, PlaneSearchMethod::MultiRansac);
  EXPECT_EQ(found.planes.size(), 6u);
}

}  // namespace
}  // namespace planar_mapping
