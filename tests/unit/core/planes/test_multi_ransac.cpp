// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <vector>

#include "planar_mapping/planes/multi_plane.h"
#include "plane_scenes.h"

namespace planar_mapping {
namespace {

MultiPlaneParams featureParams() {
  MultiPlaneParams params;
  params.method = PlaneSearchMethod::MultiRansac;
  params.min_inliers = 20;
  return params;
}

TEST(MultiRansac, FindsEveryPlaneOfSparseFeaturesOnAHundredSeeds) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const test::PlaneScene scene = test::makeRoom(600, 0.3, 0.0015, seed, test::RoomKind::Features);
    ASSERT_EQ(scene.size(), 857u);
    const test::PlaneScore score =
        scorePlanes(scene, findPlanes(scene.view(), nullptr, featureParams()));
    EXPECT_EQ(score.recall, 1.0) << seed;
    EXPECT_EQ(score.precision, 1.0) << seed;
  }
}

TEST(MultiRansac, FindsUnevenPlanesAmongMoreOutliersThanPoints) {
  double recall = 0.0, precision = 0.0;
  constexpr int kSeeds = 20;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const test::PlaneScene scene =
        test::makeRoom(600, 0.6, 0.002, seed, test::RoomKind::UnevenFeatures);
    ASSERT_EQ(scene.size(), 1500u);
    const test::PlaneScore score =
        scorePlanes(scene, findPlanes(scene.view(), nullptr, featureParams()));
    recall += score.recall / kSeeds;
    precision += score.precision / kSeeds;
  }
  EXPECT_GE(recall, 0.85);
  EXPECT_GE(precision, 0.85);
}

TEST(MultiRansac, OrderOfThePointsDoesNotMatter) {
  test::PlaneScene scene = test::makeRoom(600, 0.3, 0.0015, 4, test::RoomKind::Features);
  const PlaneSet before = findPlanes(scene.view(), nullptr, featureParams());
  Random random(2);
  scene.shuffle(random);
  const PlaneSet after = findPlanes(scene.view(), nullptr, featureParams());
  ASSERT_EQ(before.planes.size(), after.planes.size());
  for (std::size_t k = 0; k < before.planes.size(); ++k) {
    EXPECT_EQ(before.planes[k].inliers.size(), after.planes[k].inliers.size());
    EXPECT_GT(before.planes[k].plane.normal.dot(after.planes[k].plane.normal), 1.0 - 1e-9);
  }
}

TEST(MultiRansac, RespectsTheNumberOfModels) {
  const test::PlaneScene scene = test::makeRoom(600, 0.3, 0.0015, 4, test::RoomKind::Features);
  MultiPlaneParams params = featureParams();
  for (int models : {1, 3, 6}) {
    params.number_of_models = models;
    EXPECT_EQ(findPlanes(scene.view(), nullptr, params).planes.size(),
              static_cast<std::size_t>(models));
  }
}

TEST(MultiRansac, CountsDuplicatesAndKeepsThemOutOfSamples) {
  test::PlaneScene scene = test::makeRoom(600, 0.3, 0.0015, 5, test::RoomKind::Features);
  const PlaneSet once = findPlanes(scene.view(), nullptr, featureParams());
  const std::size_t number = scene.size();
  for (std::size_t i = 0; i < number; i += 2) scene.add(scene.view().point(i), scene.truth[i]);
  const PlaneSet twice = findPlanes(scene.view(), nullptr, featureParams());
  EXPECT_EQ(twice.diagnostics.duplicate_points, (number + 1) / 2);
  EXPECT_EQ(twice.planes.size(), once.planes.size());
}

TEST(MultiRansac, SeedDecidesAndRepeats) {
  const test::PlaneScene scene = test::makeRoom(600, 0.6, 0.002, 3, test::RoomKind::UnevenFeatures);
  MultiPlaneParams params = featureParams();
  const PlaneSet first = findPlanes(scene.view(), nullptr, params);
  const PlaneSet again = findPlanes(scene.view(), nullptr, params);
  ASSERT_EQ(first.planes.size(), again.planes.size());
  for (std::size_t k = 0; k < first.planes.size(); ++k)
    EXPECT_EQ(first.planes[k].inliers, again.planes[k].inliers);
  EXPECT_EQ(first.diagnostics.hypotheses, again.diagnostics.hypotheses);
  params.seed = 99;
  EXPECT_NE(findPlanes(scene.view(), nullptr, params).diagnostics.hypotheses,
            first.diagnostics.hypotheses);
}

TEST(MultiRansac, StopsAtMaxIterations) {
  const test::PlaneScene scene = test::makeRoom(600, 0.6, 0.002, 3, test::RoomKind::UnevenFeatures);
  MultiPlaneParams params = featureParams();
  params.max_iterations = 50;
  const PlaneSet set = findPlanes(scene.view(), nullptr, params);
  EXPECT_FALSE(set.diagnostics.stopped_by_itself);
  EXPECT_LT(set.diagnostics.hypotheses, 200u);
}

// Their distances have no squares, and the differences of some are no numbers: sanitizers see more.
TEST(MultiRansac, CoordinatesAtTheEndsOfFloatsAreTaken) {
  std::vector<float> xyz;
  for (int i = 0; i < 40; ++i) {
    const float far = i % 2 == 0 ? FLT_MAX : -FLT_MAX;
    xyz.insert(xyz.end(), {0.05F * static_cast<float>(i - 20) * FLT_MAX, far, far});
  }
  const PlaneSet set = findPlanes(PointsView(xyz.data(), xyz.size() / 3), nullptr, featureParams());
  EXPECT_EQ(40U, set.diagnostics.points_considered);
  for (const PlaneSegment& segment : set.planes)
    EXPECT_TRUE(segment.plane.normal.allFinite() && std::isfinite(segment.plane.offset));
}

}  // namespace
}  // namespace planar_mapping
