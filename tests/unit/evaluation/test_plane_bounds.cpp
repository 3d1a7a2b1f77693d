// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "evaluation/plane_bounds.h"
#include "labelled_clouds.h"
#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/planes/multi_plane.h"

namespace planar_mapping {
namespace evaluation {
namespace {

constexpr std::uint32_t kWidth = 60;
constexpr std::uint32_t kHeight = 40;
constexpr double kFocal = 80.0;

Vector3 rayOf(std::size_t i) {
  const auto column = static_cast<double>(i % kWidth);
  const auto row = static_cast<double>(i / kWidth);
  return {(column - 29.5) / kFocal, (row - 19.5) / kFocal, 1.0};
}

/// Two walls that meet in a corner at the middle column, a metre away.
struct Corner {
  std::vector<Plane> planes;
  std::vector<int> labels;
  std::vector<float> xyz;

  explicit Corner(double range_noise) {
    constexpr double kTilt = 0.15;  // of either, radians
    for (const double sign : {-1.0, 1.0})
      planes.push_back({Vector3(sign * std::sin(kTilt), 0.0, -std::cos(kTilt)), std::cos(kTilt)});
    Random random(7);
    for (std::size_t i = 0; i < std::size_t{kWidth} * kHeight; ++i) {
      const Vector3 direction = rayOf(i).normalized();
      labels.push_back(direction.x() < 0.0 ? 0 : 1);
      const Plane& plane = planes[static_cast<std::size_t>(labels.back())];
      const double range = -plane.offset / plane.normal.dot(direction);
      const Vector3 point = direction * (range + range_noise * random.normal());
      for (int axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(point[axis]));
    }
  }
  PointsView view() const { return PointsView(xyz.data(), kWidth, kHeight, 3); }
  PlaneTruth truth() const { return {labels, planes}; }
};

std::size_t wrongPoints(const Corner& corner, const std::vector<PlaneSegment>& segments) {
  std::size_t wrong = corner.labels.size();
  for (std::size_t s = 0; s < segments.size(); ++s) {
    for (const int i : segments[s].inliers) {
      if (corner.labels[static_cast<std::size_t>(i)] == static_cast<int>(s)) --wrong;
    }
  }
  return wrong;
}

TEST(PlaneBounds, NeighboursTellPlanesApartThatNoiseDoesNot) {
  const Corner corner(0.03);
  KnownPlanesParams params;
  params.range_noise = 0.03;
  params.sweeps = 0;
  const std::size_t each =
      wrongPoints(corner, assignToKnownPlanes(corner.view(), corner.planes, params));
  params.sweeps = 8;
  const std::size_t together =
      wrongPoints(corner, assignToKnownPlanes(corner.view(), corner.planes, params));
  EXPECT_GT(each, 300U) << "of 2,400";
  EXPECT_LT(together, 100U);
}

TEST(PlaneBounds, WithoutNoiseOnlyTheEdgeIsInDoubt) {
  const Corner corner(0.0);
  KnownPlanesParams params;
  params.range_noise = 0.001;
  const auto segments = assignToKnownPlanes(corner.view(), corner.planes, params);
  ASSERT_EQ(segments.size(), 2U);
  EXPECT_LE(wrongPoints(corner, segments), 2 * std::size_t{kHeight});
  EXPECT_EQ(segments[1].plane.normal, corner.planes[1].normal);
}

TEST(PlaneBounds, LeavesOutPointsWithoutRangeAndPlanesWithoutPoints) {
  Corner corner(0.0);
  corner.xyz[2] = std::numeric_limits<float>::quiet_NaN();
  corner.planes.push_back({Vector3(0.0, 0.0, -1.0), 5.0});
  corner.planes.push_back({Vector3(0.0, 0.0, -1.0), -5.0});  // behind the sensor
  const auto segments = assignToKnownPlanes(corner.view(), corner.planes, {});
  ASSERT_EQ(segments.size(), 2U);
  EXPECT_EQ(segments[0].inliers.size() + segments[1].inliers.size(), corner.labels.size() - 1);
  EXPECT_NE(segments[0].inliers.front(), 0);
  EXPECT_TRUE(assignToKnownPlanes(corner.view(), {}, {}).empty());
}

TEST(PlaneBounds, MeasuresAgainAlongTheSameRays) {
  const Corner corner(0.0);
  PlaneTruth truth = corner.truth();
  truth.labels[5] = kOnNoPlane;
  const std::vector<float> again = measuredAgain(corner.view(), truth, 0.02, 3);
  ASSERT_EQ(again.size(), corner.xyz.size());
  const PointsView view(again.data(), kWidth, kHeight, 3);
  double squares = 0.0;
  for (std::size_t i = 0; i < view.size; ++i) {
    const Vector3 point = view.point(i);
    EXPECT_NEAR(point.normalized().dot(rayOf(i).normalized()), 1.0, 1e-6);
    const double error = point.norm() - corner.view().point(i).norm();
    squares += error * error;
    if (i == 5) {
      EXPECT_EQ(point, corner.view().point(i));
    }
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(view.size)), 0.02, 0.001);
  EXPECT_EQ(again, measuredAgain(corner.view(), truth, 0.02, 3));
  EXPECT_NE(again, measuredAgain(corner.view(), truth, 0.02, 4));
}

TEST(PlaneBounds, SaysWhatIsWrong) {
  const Corner corner(0.0);
  const PointsView line(corner.xyz.data(), corner.labels.size());
  EXPECT_THROW(assignToKnownPlanes(line, corner.planes, {}), InputError);
  KnownPlanesParams params;
  params.edge_cost = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(assignToKnownPlanes(corner.view(), corner.planes, params), ParameterError);
  PlaneTruth truth = corner.truth();
  EXPECT_THROW(measuredAgain(corner.view(), truth, -0.1, 1), ParameterError);
  truth.labels.pop_back();
  EXPECT_THROW(measuredAgain(corner.view(), truth, 0.1, 1), InputError);
}

}  // namespace
}  // namespace evaluation
}  // namespace planar_mapping

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
  EXPECT_GE(quality.correct, 21);
  EXPECT_GE(quality.precision(), 0.77);
  EXPECT_LT(quality.meanAngle(), 0.6 * M_PI / 180.0) << "edges turn the planes";
  EXPECT_GE(faces(cloud, planes).correct, 23) << "of 28";
  EXPECT_GE(faces(cloud, planes).precision(), 0.8);
  EXPECT_GE(joined(cloud, planes).recall(), 0.85);
  EXPECT_GE(joined(cloud, planes).precision(), 0.85);
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
