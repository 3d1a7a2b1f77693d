// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "evaluation/metrics/plane_quality.h"
#include "labelled_clouds.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping {
namespace {

// How good the planes of labelled clouds are, with default parameters: the figures of
// docs/results.md may not get worse.

using namespace evaluation;
using test::LabelledCloud;

std::vector<PlaneSegment> planesOf(const LabelledCloud& cloud, int min_inliers) {
  MultiPlaneParams params;
  params.min_inliers = min_inliers;
  return findPlanes(cloud.view(), nullptr, params).planes;
}

/// Of planes of space: what is coplanar is one; labels of 100 points and more.
PlaneQuality joined(const LabelledCloud& cloud, const std::vector<PlaneSegment>& planes) {
  const CoplanarParams params;
  const PlaneTruth large = truthOf(cloud.view(), cloud.truth.labels, cloud.truth.planes, 100);
  return judgePlanes(joinCoplanar(cloud.view(), large, params),
                     joinCoplanar(cloud.view(), planes, params));
}

/// Of connected faces of 100 points and more.
PlaneQuality faces(const LabelledCloud& cloud, const std::vector<PlaneSegment>& planes) {
  return judgePlanes(splitFaces(cloud.view(), cloud.truth, 100),
                     splitFaces(cloud.view(), planes, 100));
}

TEST(LabelledPlanes, RoomFramesNotTunedOn) {
  PlaneQuality sum;
  for (const std::uint64_t seed : {100, 101}) {
    const LabelledCloud cloud = test::roomFrame(seed);
    sum.add(judgePlanes(cloud.truth, planesOf(cloud, 1000)));
  }
  EXPECT_GE(sum.true_planes, 22);
  EXPECT_GE(sum.recall(), 0.9);
  EXPECT_GE(sum.precision(), 0.9);
  EXPECT_LT(sum.meanAngle(), 1.0 * M_PI / 180.0);
}

TEST(LabelledPlanes, Polyhedra) {
  if (test::isMissing("labelled_synpeb/polyhedra_clean.pcd")) GTEST_SKIP() << "no polyhedra_clean";
  const LabelledCloud cloud = test::readSynpeb("polyhedra_clean");
  const std::vector<PlaneSegment> planes = planesOf(cloud, 100);
  const PlaneQuality quality = judgePlanes(cloud.truth, planes);
  EXPECT_EQ(quality.true_planes, 38);
  EXPECT_GE(quality.correct, 34) << "three of the others are coplanar with these, one is small";
  EXPECT_EQ(quality.segments, quality.correct);
  EXPECT_EQ(faces(cloud, planes).true_planes, 37);
  EXPECT_EQ(faces(cloud, planes).correct, 37);
  EXPECT_EQ(faces(cloud, planes).segments, 37);
  EXPECT_EQ(joined(cloud, planes).true_planes, 34);
  EXPECT_EQ(joined(cloud, planes).correct, 34);
  EXPECT_EQ(joined(cloud, planes).segments, 34);
}

TEST(LabelledPlanes, SmallImageOfPolyhedra) {
  const LabelledCloud cloud = test::readSynpeb("small_clean");
  const std::vector<PlaneSegment> planes = planesOf(cloud, 100);
  const PlaneQuality quality = judgePlanes(cloud.truth, planes);
  EXPECT_EQ(quality.true_planes, 12);
  EXPECT_GE(quality.correct, 10) << "the others have 9 and 16 points";
  EXPECT_EQ(quality.segments, quality.correct);
  EXPECT_EQ(joined(cloud, planes).true_planes, joined(cloud, planes).correct);
}

TEST(LabelledPlanes, StairsInNoiseAsLargeAsTheSteps) {
  if (test::isMissing("labelled_synpeb/spiral_stairs_noisy.pcd")) GTEST_SKIP() << "no stairs";
  const LabelledCloud cloud = test::readSynpeb("spiral_stairs_noisy");
  const std::vector<PlaneSegment> planes = planesOf(cloud, 100);
  const PlaneQuality quality = judgePlanes(cloud.truth, planes);
  EXPECT_EQ(quality.true_planes, 30);
  EXPECT_GE(quality.correct, 17);
  EXPECT_GE(quality.precision(), 0.68);
  EXPECT_LT(quality.meanAngle(), 0.6 * M_PI / 180.0) << "edges turn the planes";
  EXPECT_GE(faces(cloud, planes).correct, 19) << "of 28";
  EXPECT_GE(faces(cloud, planes).precision(), 0.73);
  EXPECT_GE(joined(cloud, planes).recall(), 0.66);
  EXPECT_GE(joined(cloud, planes).precision(), 0.72);
}

TEST(LabelledPlanes, RenderedRoom) {
  const LabelledCloud cloud = test::readIclFrame();
  const std::vector<PlaneSegment> planes = planesOf(cloud, 100);
  const PlaneQuality quality = joined(cloud, planes);
  EXPECT_EQ(quality.true_planes, 10);
  EXPECT_EQ(quality.correct, 10);
  EXPECT_EQ(quality.segments, 10);
  EXPECT_GE(faces(cloud, planes).correct, 10) << "of 17";
}

TEST(LabelledPlanes, TableTops) {
  if (test::isMissing("labelled_mosd_tabletop"))
    GTEST_SKIP() << "labelled_mosd_tabletop is missing";
  for (const char* name : {"learn0", "test16"}) {
    const LabelledCloud cloud = test::readTabletop(name);
    const PlaneQuality quality = judgePlanes(cloud.truth, planesOf(cloud, 100));
    EXPECT_EQ(quality.correct, 1) << name;
    EXPECT_EQ(quality.segments, 1) << name;
    EXPECT_GT(quality.pointRecall(), 0.95) << name;
  }
}

}  // namespace
}  // namespace planar_mapping
