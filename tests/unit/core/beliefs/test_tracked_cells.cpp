// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Beliefs of KlOccupancy from tracked key features.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/beliefs/kl_occupancy.h"

namespace planar_mapping {
namespace {

constexpr double kSide = 0.25;

/// One pixel in the middle of each cell of a wall of so many cells, z = 2.125.
struct Wall {
  explicit Wall(std::uint32_t columns, std::uint32_t rows = 2) : width(columns), height(rows) {
    for (std::uint32_t row = 0; row < rows; ++row) {
      for (std::uint32_t column = 0; column < columns; ++column) {
        const auto x = static_cast<float>(kSide * (column + 0.5));
        const auto y = static_cast<float>(kSide * (row + 0.5));
        xyz.insert(xyz.end(), {x, y, 2.125f});
        labels.push_back(0);
        indices.push_back(static_cast<int>(indices.size()));
      }
    }
  }
  KeyFeature feature(std::int64_t track, std::uint32_t column, std::uint32_t row = 0) const {
    KeyFeature f;
    f.track = track;
    f.column = static_cast<float>(column);
    f.row = static_cast<float>(row);
    const float* p = &xyz[3 * (row * width + column)];
    f.position = Vector3(p[0], p[1], p[2]);
    return f;
  }
  OccupancyFrame frame(const std::vector<KeyFeature>& features) const {
    OccupancyFrame of;
    of.points = PointsView(xyz.data(), width, height, 3);
    of.indices = &indices;
    of.plane_labels = &labels;
    of.key_features = &features;
    of.motion = FrameMotion();
    return of;
  }
  std::uint32_t width, height;
  std::vector<float> xyz;
  std::vector<std::int32_t> labels;
  Indices indices;
};

KlOccupancyParams trackedParams() {
  KlOccupancyParams params;
  params.source = FeatureSource::Tracks;
  params.resolution = kSide;
  return params;
}

TEST(TrackedCells, AFeatureOnASurfaceIsBelievedAndStaysBelieved) {
  const Wall wall(3);
  KlOccupancy beliefs(trackedParams());
  std::vector<float> p(wall.xyz.size() / 3, -1.0f);
  const std::vector<KeyFeature> features{wall.feature(7, 1)};
  for (int i = 0; i < 5; ++i) {
    const auto summary = beliefs.update(wall.frame(features), p);
    EXPECT_EQ(summary.beliefs.updated, i > 0 ? 1u : 0u);
    EXPECT_EQ(summary.cells_of_features, 1u);
    EXPECT_EQ(summary.cells_of_neighbours, 5u);
    for (const float belief : p) EXPECT_NEAR(belief, 1.0f, 1e-5f);
  }
}

TEST(TrackedCells, WithoutDenseGroupsALonelyFeatureFades) {
  const Wall wall(3);
  KlOccupancyParams paper = trackedParams();
  paper.dense_groups = false;
  KlOccupancy beliefs(paper);
  std::vector<float> p(wall.xyz.size() / 3, -1.0f);
  const std::vector<KeyFeature> features{wall.feature(7, 1)};
  beliefs.update(wall.frame(features), p);
  EXPECT_FLOAT_EQ(p[0], 0.5f);
  beliefs.update(wall.frame(features), p);
  EXPECT_NEAR(p[0], std::exp(-1.07), 1e-5);
}

// Beliefs 1 at one end and exp(-E) at the other: between them means of the rings, by hand.
TEST(TrackedCells, CellsWithoutFeaturesTakeTheMeanOfTheirNeighbours) {
  const Wall wall(4, 2);
  KlOccupancyParams alike = trackedParams();
  alike.doubt_spreads = true;
  KlOccupancy beliefs(alike);
  KlOccupancy cautious(trackedParams());
  std::vector<float> p(wall.xyz.size() / 3, -1.0f);
  std::vector<KeyFeature> features{wall.feature(1, 0), wall.feature(2, 3)};
  beliefs.update(wall.frame(features), p);
  // The second track was matched wrongly before: where it was expected is a metre away.
  std::vector<KeyFeature> jumped = features;
  std::swap(jumped[0].track, jumped[1].track);
  jumped[0].track = 3;
  beliefs.update(wall.frame(jumped), p);
  const double low = *beliefs.tracks().belief(1);
  EXPECT_LT(low, 0.01);
  EXPECT_NEAR(p[0], 1.0, 1e-5);
  EXPECT_NEAR(p[3], low, 1e-5);
  EXPECT_NEAR(p[1], 1.0, 1e-5);  // beside the first only
  EXPECT_NEAR(p[2], low, 1e-5);
  EXPECT_NEAR(p[4], 1.0, 1e-5);
  EXPECT_NEAR(p[7], low, 1e-5);

  // By default one wrong match speaks for its own cell alone.
  cautious.update(wall.frame(features), p);
  cautious.update(wall.frame(jumped), p);
  EXPECT_NEAR(p[3], low, 1e-5);
  for (const std::size_t i : {0u, 1u, 2u, 4u, 5u, 6u, 7u}) EXPECT_NEAR(p[i], 1.0, 1e-5) << i;
}

TEST(TrackedCells, OtherPlanesAndFarPatchesTakeTheBeliefOfTheirPoints) {
  Wall wall(5, 2);
  for (std::size_t i : {2u, 7u}) wall.xyz[3 * i] = test::kNanFloat;  // a gap of one cell
  wall.labels[3] = wall.labels[8] = 1;
  KlOccupancy beliefs(trackedParams());
  std::vector<float> p(wall.xyz.size() / 3, -1.0f);
  const std::vector<KeyFeature> features{wall.feature(1, 0)};
  const auto summary = beliefs.update(wall.frame(features), p);
  EXPECT_EQ(summary.cells_of_features, 1u);
  EXPECT_EQ(summary.cells_of_neighbours, 3u);
  EXPECT_EQ(summary.cells_of_points, 4u);
  EXPECT_FLOAT_EQ(p[3], 0.5f);  // a single point in its cell
  EXPECT_FLOAT_EQ(p[4], 0.5f);
  EXPECT_FLOAT_EQ(p[2], 0.0f);  // no measurement
}

TEST(TrackedCells, AFeatureThatDisagreesWithItsPixelBelongsWhereItLies) {
  const Wall wall(3);
  KlOccupancy beliefs(trackedParams());
  std::vector<float> p(wall.xyz.size() / 3, -1.0f);
  std::vector<KeyFeature> features{wall.feature(1, 1)};
  features[0].position *= 0.4;  // a wrong disparity
  const auto summary = beliefs.update(wall.frame(features), p);
  EXPECT_EQ(summary.beliefs.created, 1u);
  EXPECT_EQ(summary.cells_of_features, 0u);
  EXPECT_EQ(summary.cells_of_points, 6u);
}

TEST(TrackedCells, FollowsFeaturesThroughTheMotionInBothReadings) {
  for (const MotionReading reading : {MotionReading::FeaturePosition, MotionReading::RobotPose}) {
    KlOccupancyParams reading_params = trackedParams();
    reading_params.beliefs.motion_reading = reading;
    KlOccupancy beliefs(reading_params);
    Wall wall(3);
    std::vector<float> p(wall.xyz.size() / 3, -1.0f);
    std::vector<KeyFeature> features{wall.feature(1, 1)};
    beliefs.update(wall.frame(features), p);
    for (std::size_t i = 0; i < wall.xyz.size(); i += 3) wall.xyz[i + 2] -= 0.5f;
    features = {wall.feature(1, 1)};
    OccupancyFrame frame = wall.frame(features);
    frame.T_world_sensor = Pose::Identity();
    frame.T_world_sensor->translation().z() = 0.5;
    frame.motion->T_now_before.translation().z() = -0.5;
    frame.motion->covariance.setIdentity();
    frame.motion->covariance *= 1e-4;
    frame.motion->predicted = frame.motion->T_now_before;
    beliefs.update(frame, p);
    EXPECT_NEAR(p[1], 1.0f, 1e-4f);
    // And against it: half a metre where none was.
    frame.motion->T_now_before.setIdentity();
    beliefs.update(frame, p);
    if (reading == MotionReading::RobotPose) {
      EXPECT_LT(p[1], 1e-3f);
    } else {
      EXPECT_NEAR(p[1], 1.0f, 1e-4f);  // the feature itself has not moved since
    }
  }
}

TEST(TrackedCells, CountsWhatCannotBeFollowed) {
  const Wall wall(3);
  KlOccupancy beliefs(trackedParams());
  std::vector<float> p(wall.xyz.size() / 3, -1.0f);
  std::vector<KeyFeature> features(4, wall.feature(1, 1));
  features[0].track = -1;
  features[1].position.x() = test::kNanFloat;
  features[1].column = test::kNanFloat;
  features[2].position.x() = 1e9;  // disagrees with its pixel and is beyond the grid
  const auto summary = beliefs.update(wall.frame(features), p);
  EXPECT_EQ(summary.features_ignored, 3u);
  EXPECT_EQ(summary.beliefs.created, 1u);
}

TEST(TrackedCells, FindsThePixelOfAFeatureAmongIndicesInAnyOrder) {
  const Wall wall(3);
  KlOccupancy sorted(trackedParams());
  KlOccupancy reversed(trackedParams());
  const std::vector<KeyFeature> features{wall.feature(7, 1)};
  std::vector<float> p;
  EXPECT_EQ(sorted.update(wall.frame(features), p).cells_of_neighbours, 5u);
  Indices backwards(wall.indices.rbegin(), wall.indices.rend());
  OccupancyFrame frame = wall.frame(features);
  frame.indices = &backwards;
  EXPECT_EQ(reversed.update(frame, p).cells_of_neighbours, 5u);
  // Its point is not among the indices: the feature is on no plane.
  backwards.erase(std::find(backwards.begin(), backwards.end(), 1));
  reversed.reset();
  EXPECT_EQ(reversed.update(frame, p).cells_of_neighbours, 0u);
}

TEST(TrackedCells, SurvivesEmptyFramesAndRejectsBadOnes) {
  KlOccupancy beliefs(trackedParams());
  const Wall wall(3);
  const std::vector<KeyFeature> features{wall.feature(1, 1)};
  std::vector<float> p;
  OccupancyFrame empty;
  EXPECT_EQ(beliefs.update(empty, p).beliefs.created, 0u);
  empty.key_features = &features;
  EXPECT_EQ(beliefs.update(empty, p).beliefs.created, 1u);
  beliefs.reset();
  OccupancyFrame frame = wall.frame(features);
  frame.T_world_sensor = Pose::Identity();
  frame.T_world_sensor->translation().x() = test::kNanFloat;
  EXPECT_THROW(beliefs.update(frame, p), InputError);
  const Indices outside{6};
  frame = wall.frame(features);
  frame.indices = &outside;
  EXPECT_THROW(beliefs.update(frame, p), InputError);
  frame = wall.frame(features);
  frame.motion->covariance(0, 0) = -1.0;
  EXPECT_THROW(beliefs.update(frame, p), ParameterError);
  EXPECT_EQ(beliefs.tracks().size(), 0u);
}

}  // namespace
}  // namespace planar_mapping
