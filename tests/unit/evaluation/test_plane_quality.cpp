// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/metrics/plane_quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "planar_mapping/base/error.h"

namespace planar_mapping::evaluation {
namespace {

PlaneSegment segment(int first, int count, const Vector3& normal = Vector3::UnitZ()) {
  PlaneSegment result;
  result.plane.normal = normal.normalized();
  result.inliers.resize(static_cast<std::size_t>(count));
  std::iota(result.inliers.begin(), result.inliers.end(), first);
  return result;
}

/// A line of points; labels as runs {label, count}, all planes with normal z.
PlaneTruth truthOfRuns(const std::vector<std::pair<int, int>>& runs, int planes) {
  PlaneTruth truth;
  for (const auto& [label, count] : runs)
    truth.labels.insert(truth.labels.end(), static_cast<std::size_t>(count), label);
  truth.planes.resize(static_cast<std::size_t>(planes));
  return truth;
}

TEST(PlaneQuality, CountsAPairThatSharesFourFifthsOfBoth) {
  const PlaneTruth truth = truthOfRuns({{0, 100}, {kOnNoPlane, 100}}, 1);
  // 80 of 100 points of the plane, and 80 of 100 points of the segment.
  const PlaneQuality quality = judgePlanes(truth, {segment(20, 100, {0.0, 1.0, 10.0})});
  EXPECT_EQ(quality.correct, 1);
  EXPECT_EQ(quality.missed + quality.noise + quality.over + quality.under, 0);
  EXPECT_EQ(quality.recall(), 1.0);
  EXPECT_EQ(quality.precision(), 1.0);
  EXPECT_EQ(quality.pointRecall(), 0.8);
  EXPECT_NEAR(quality.meanAngle(), std::atan(0.1), 1e-12);
  // One point less of either is too few.
  const PlaneQuality moved = judgePlanes(truth, {segment(21, 100)});
  EXPECT_EQ(moved.correct, 0);
  EXPECT_EQ(moved.missed, 1);
  EXPECT_EQ(moved.noise, 1);
  EXPECT_EQ(moved.recall(), 0.0);
  EXPECT_EQ(moved.precision(), 0.0);
}

TEST(PlaneQuality, TellsOverFromUnderSegmentation) {
  // Plane 0 is cut in two segments, planes 1 and 2 are one segment, plane 3 is not found and the
  // last segment is where no plane is.
  const PlaneTruth truth = truthOfRuns({{0, 100}, {1, 50}, {2, 50}, {3, 40}, {kOnNoPlane, 30}}, 4);
  const PlaneQuality quality =
      judgePlanes(truth, {segment(0, 45), segment(45, 50), segment(100, 100), segment(240, 30)});
  EXPECT_EQ(quality.true_planes, 4);
  EXPECT_EQ(quality.segments, 4);
  EXPECT_EQ(quality.correct, 0);
  EXPECT_EQ(quality.over, 1);
  EXPECT_EQ(quality.under, 1);
  EXPECT_EQ(quality.missed, 1);
  EXPECT_EQ(quality.noise, 1);
  // 50 of plane 0, 50 of 1 and of 2, none of 3.
  EXPECT_DOUBLE_EQ(quality.pointRecall(), 150.0 / 240.0);
}

TEST(PlaneQuality, PrefersAPairToOverSegmentation) {
  const PlaneTruth truth = truthOfRuns({{0, 100}}, 1);
  const PlaneQuality quality = judgePlanes(truth, {segment(0, 85), segment(85, 15)});
  EXPECT_EQ(quality.correct, 1);
  EXPECT_EQ(quality.over, 0);
  EXPECT_EQ(quality.noise, 1);
  EXPECT_EQ(quality.precision(), 0.5);
}

TEST(PlaneQuality, LeavesOutWhatIsNotJudged) {
  const PlaneTruth truth = truthOfRuns({{0, 100}, {kNotJudged, 100}}, 1);
  // Half of the first segment and all of the second are where nothing is known.
  const PlaneQuality quality = judgePlanes(truth, {segment(0, 180), segment(180, 20)});
  EXPECT_EQ(quality.segments, 1);
  EXPECT_EQ(quality.correct, 1);
  EXPECT_EQ(quality.precision(), 1.0);
}

TEST(PlaneQuality, IsPerfectWhereNothingIsThere) {
  const PlaneQuality quality = judgePlanes({}, {});
  EXPECT_EQ(quality.recall(), 1.0);
  EXPECT_EQ(quality.precision(), 1.0);
  EXPECT_EQ(quality.pointRecall(), 1.0);
  EXPECT_EQ(quality.meanAngle(), 0.0);
}

TEST(PlaneQuality, AddsCloudsPlaneByPlane) {
  const PlaneTruth truth = truthOfRuns({{0, 10}, {1, 10}}, 2);
  PlaneQuality sum = judgePlanes(truth, {segment(0, 10), segment(10, 10)});
  sum.add(judgePlanes(truth, {}));
  EXPECT_EQ(sum.recall(), 0.5);
  EXPECT_EQ(sum.precision(), 1.0);
  EXPECT_EQ(sum.angles.size(), 2u);
}

TEST(PlaneQuality, RefusesWhatContradictsItself) {
  const PlaneTruth truth = truthOfRuns({{0, 10}}, 1);
  EXPECT_THROW(judgePlanes(truth, {segment(5, 10)}), InputError);
  EXPECT_THROW(judgePlanes(truth, {segment(0, 5), segment(4, 2)}), InputError);
  EXPECT_THROW(judgePlanes(truthOfRuns({{1, 10}}, 1), {}), InputError);
  EXPECT_THROW(judgePlanes(truthOfRuns({{-3, 10}}, 1), {}), InputError);
  EXPECT_THROW(judgePlanes(truth, {}, 0.5), ParameterError);
  EXPECT_THROW(judgePlanes(truth, {}, 1.1), ParameterError);
  EXPECT_THROW(judgePlanes(truth, {}, std::numeric_limits<double>::quiet_NaN()), ParameterError);
}

/// Squares of 11 x 11 points, 1 m wide, at these heights, side by side.
std::vector<float> terraces(const std::vector<double>& heights) {
  std::vector<float> xyz;
  for (std::size_t k = 0; k < heights.size(); ++k) {
    for (int i = 0; i < 121; ++i) {
      xyz.push_back(static_cast<float>(2.0 * static_cast<double>(k) + 0.1 * (i % 11)));
      xyz.push_back(static_cast<float>(0.1 * (i / 11)));
      xyz.push_back(static_cast<float>(heights[k]));
    }
  }
  return xyz;
}

std::vector<int> terraceLabels(const std::vector<int>& of_each) {
  std::vector<int> labels;
  for (const int label : of_each) labels.insert(labels.end(), 121, label);
  return labels;
}

TEST(PlaneTruthOfLabels, FitsThePlanesOfTheLabels) {
  const std::vector<float> xyz = terraces({2.0, 3.0, 4.0});
  const PointsView points(xyz.data(), xyz.size() / 3);
  const PlaneTruth truth = truthOfLabels(points, terraceLabels({7, kOnNoPlane, 12}));
  ASSERT_EQ(truth.planes.size(), 2u);
  for (const Plane& plane : truth.planes) EXPECT_NEAR(std::fabs(plane.normal.z()), 1.0, 1e-6);
  EXPECT_NEAR(std::fabs(truth.planes[0].offset), 2.0, 1e-5);
  EXPECT_NEAR(std::fabs(truth.planes[1].offset), 4.0, 1e-5);
  EXPECT_EQ(truth.labels[0], 0);
  EXPECT_EQ(truth.labels[121], kOnNoPlane);
  EXPECT_EQ(truth.labels[242], 1);
}

TEST(PlaneTruthOfLabels, DoesNotJudgeSmallOnesAndPointsThatAreNotFinite) {
  std::vector<float> xyz = terraces({2.0, 3.0});
  xyz[0] = std::numeric_limits<float>::quiet_NaN();
  const PointsView points(xyz.data(), xyz.size() / 3);
  const PlaneTruth truth = truthOfLabels(points, terraceLabels({0, 1}), 121);
  ASSERT_EQ(truth.planes.size(), 1u);
  EXPECT_EQ(truth.labels[0], kNotJudged);
  EXPECT_EQ(truth.labels[1], kNotJudged);
  EXPECT_EQ(truth.labels[121], 0);
  EXPECT_THROW(truthOfLabels(points, {0}), InputError);
  EXPECT_THROW(truthOfLabels(points, terraceLabels({0, -3})), InputError);
  EXPECT_THROW(truthOfLabels(points, terraceLabels({0, 1}), 2), ParameterError);
}

TEST(JoinCoplanar, JoinsLabelsAndSegmentsByOneRule) {
  // The first and the third are one plane within 2 cm, the second is 5 cm above.
  const std::vector<float> xyz = terraces({2.0, 2.05, 2.015});
  const PointsView points(xyz.data(), xyz.size() / 3);
  const PlaneTruth truth = truthOfLabels(points, terraceLabels({0, 1, 2}));
  const PlaneTruth joined = joinCoplanar(points, truth, {});
  ASSERT_EQ(joined.planes.size(), 2u);
  EXPECT_EQ(joined.labels[0], joined.labels[242]);
  EXPECT_NE(joined.labels[0], joined.labels[121]);
  const std::vector<PlaneSegment> segments =
      joinCoplanar(points, {segment(0, 121), segment(121, 121), segment(242, 121)}, {});
  ASSERT_EQ(segments.size(), 2u);
  EXPECT_EQ(judgePlanes(joined, segments).correct, 2);
  CoplanarParams narrow;
  narrow.max_distance = 0.01;
  EXPECT_EQ(joinCoplanar(points, truth, narrow).planes.size(), 3u);
  narrow.max_angle = 0.0;
  EXPECT_THROW(joinCoplanar(points, truth, narrow), ParameterError);
}

/// A wall of 24 x 8 points with labels by column; \p gap columns in the middle carry none.
std::vector<int> halves(int gap) {
  std::vector<int> labels(24 * 8, 0);
  for (int i = 0; i < 24 * 8; ++i) {
    const int column = i % 24;
    if (column >= 8 && column < 8 + gap) labels[static_cast<std::size_t>(i)] = kOnNoPlane;
  }
  return labels;
}

std::vector<float> wall() {
  std::vector<float> xyz;
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column < 24; ++column)
      xyz.insert(xyz.end(), {0.1F * static_cast<float>(column), 0.1F * static_cast<float>(row), 2});
  }
  return xyz;
}

TEST(SplitFaces, CutsPlanesAndSegmentsWhereBlocksOfPixelsAreBetween) {
  const std::vector<float> xyz = wall();
  const PointsView points(xyz.data(), 24, 8, 3);
  // Four columns are a block, three leave one with points.
  EXPECT_EQ(splitFaces(points, truthOfLabels(points, halves(3)), 3).planes.size(), 1u);
  const PlaneTruth truth = truthOfLabels(points, halves(4));
  const PlaneTruth faces = splitFaces(points, truth, 3);
  ASSERT_EQ(faces.planes.size(), 2u);
  EXPECT_EQ(faces.labels[0], 0);
  EXPECT_EQ(faces.labels[8], kOnNoPlane);
  EXPECT_EQ(faces.labels[12], 1);
  PlaneSegment whole;
  whole.plane = truth.planes[0];
  for (std::size_t i = 0; i < truth.labels.size(); ++i) {
    if (truth.labels[i] == 0) whole.inliers.push_back(static_cast<int>(i));
  }
  const std::vector<PlaneSegment> segments = splitFaces(points, {whole}, 3);
  ASSERT_EQ(segments.size(), 2u);
  EXPECT_EQ(segments[0].inliers.size(), 64u);
  EXPECT_EQ(segments[1].inliers.size(), 96u);
  EXPECT_EQ(judgePlanes(faces, segments).correct, 2);
}

TEST(SplitFaces, DoesNotJudgeSmallFaces) {
  const std::vector<float> xyz = wall();
  const PointsView points(xyz.data(), 24, 8, 3);
  const PlaneTruth faces = splitFaces(points, truthOfLabels(points, halves(4)), 65);
  ASSERT_EQ(faces.planes.size(), 1u);
  EXPECT_EQ(faces.labels[0], kNotJudged);
  EXPECT_EQ(faces.labels[12], 0);
  const PointsView list(xyz.data(), xyz.size() / 3);
  EXPECT_THROW(splitFaces(list, truthOfLabels(points, halves(4)), 3), InputError);
  EXPECT_THROW(splitFaces(points, truthOfLabels(points, halves(4)), 2), ParameterError);
  PlaneSegment outside;
  outside.inliers = {24 * 8};
  EXPECT_THROW(splitFaces(points, std::vector<PlaneSegment>{outside}, 3), InputError);
}

}  // namespace
}  // namespace planar_mapping::evaluation
