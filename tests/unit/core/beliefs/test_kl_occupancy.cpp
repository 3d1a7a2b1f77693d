// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/beliefs/kl_occupancy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping {
namespace {

/// A frame of points, some of them with a track.
struct Tracked {
  std::vector<float> xyz;
  std::vector<std::int64_t> tracks;
  OccupancyFrame frame() const {
    OccupancyFrame frame;
    frame.points = PointsView(xyz.data(), xyz.size() / 3);
    if (!tracks.empty()) frame.tracks = &tracks;
    return frame;
  }
};

std::vector<float> probabilities(KlOccupancy& occupancy, const OccupancyFrame& frame) {
  std::vector<float> probability;
  occupancy.update(frame, probability);
  return probability;
}

TEST(KlOccupancy, TrackedPointsFollowTheirHistory) {
  // Two features in one cell at the same range: Eq. 4 gives 1 to both.
  const Tracked points{{0.01f, 0.01f, 2.01f, 0.01f, 0.01f, 2.01f}, {3, 4}};
  KlOccupancy occupancy;
  OccupancyFrame frame = points.frame();
  EXPECT_EQ(probabilities(occupancy, frame), (std::vector<float>{1.0f, 1.0f}));
  frame.motion = FrameMotion();
  EXPECT_NEAR(probabilities(occupancy, frame)[0], 1.0f, 1e-5f);
  EXPECT_EQ(occupancy.tracks().size(), 2u);
}

TEST(KlOccupancy, LonelyTrackLosesBeliefAsEquation10Says) {
  const Tracked points{{0, 0, 2}, {1}};
  KlOccupancy occupancy;
  OccupancyFrame frame = points.frame();
  frame.motion = FrameMotion();
  EXPECT_FLOAT_EQ(probabilities(occupancy, frame)[0], 0.5f);
  EXPECT_NEAR(probabilities(occupancy, frame)[0], std::exp(-1.07), 1e-5);
}

TEST(KlOccupancy, UntrackedPointsTakeTheFeaturesAroundThem) {
  const Tracked points{{0.05f, 0.05f, 2.05f, 0.06f, 0.06f, 2.05f,  // in the cell of the feature
                        0.15f, 0.05f, 2.05f,                       // in the next one
                        5.0f, 0.0f, 2.0f},                         // out of reach
                       {1, -1, -1, -1}};
  KlOccupancyParams params;
  params.dense_groups = false;
  params.beliefs.occupancy.single_feature_probability = 0.7;
  KlOccupancy occupancy(params);
  std::vector<float> p;
  const KlOccupancyDiagnostics diagnostics = occupancy.update(points.frame(), p);
  for (const float value : p) EXPECT_FLOAT_EQ(value, 0.7f);
  EXPECT_EQ(diagnostics.source, FeatureSource::Tracks);
  EXPECT_EQ(diagnostics.cells_of_features, 1u);
  EXPECT_EQ(diagnostics.cells_of_neighbours, 1u);
  EXPECT_EQ(diagnostics.cells_of_points, 1u);
}

TEST(KlOccupancy, ATrackedPointKeepsItsOwnBeliefInASharedCell) {
  KlOccupancy occupancy;
  Tracked points{{0.01f, 0.05f, 2.05f, 0.02f, 0.05f, 2.05f, 0.33f, 0.05f, 2.05f}, {1, 2, 3}};
  OccupancyFrame frame = points.frame();
  frame.motion = FrameMotion();
  frame.motion->covariance = 1e-6 * Matrix6::Identity();
  probabilities(occupancy, frame);
  points.xyz[6] = 0.03f;  // 0.3 m from where it was expected
  const std::vector<float> p = probabilities(occupancy, frame);
  EXPECT_GT(p[0], 0.9f);
  EXPECT_GT(p[1], 0.9f);
  EXPECT_LT(p[2], 0.1f);
}

TEST(KlOccupancy, AutoTakesTracksWhereAFrameHasThem) {
  const Tracked tracked{{0, 0, 2}, {1}};
  const Tracked plain{{0, 0, 2}, {}};
  KlOccupancy occupancy;
  std::vector<float> p;
  EXPECT_EQ(occupancy.update(tracked.frame(), p).source, FeatureSource::Tracks);
  EXPECT_EQ(occupancy.update(plain.frame(), p).source, FeatureSource::Cells);
  KlOccupancyParams params;
  params.source = FeatureSource::Cells;
  occupancy.setParams(params);
  EXPECT_EQ(occupancy.update(tracked.frame(), p).beliefs.updated, 1u);
}

TEST(KlOccupancy, WithoutAMotionThePosesOfTwoFramesTell) {
  // The feature is where the poses say it should be, or half a metre from there.
  for (const double ahead : {0.5, 0.0}) {
    Tracked points{{0.01f, 0.01f, 2.01f, 0.012f, 0.01f, 2.01f}, {1, 2}};
    KlOccupancy occupancy;
    OccupancyFrame frame = points.frame();
    frame.T_world_sensor = Pose::Identity();
    probabilities(occupancy, frame);
    points.xyz[2] = points.xyz[5] = 1.51f;
    frame.T_world_sensor->translation().z() = ahead;
    const float p = probabilities(occupancy, frame)[0];
    if (ahead > 0.0) {
      EXPECT_GT(p, 0.9f);
    } else {
      EXPECT_LT(p, 0.1f);
    }
  }
}

TEST(KlOccupancy, WithUnknownPosesTheMotionIsUnknown) {
  Tracked points{{0.01f, 0.01f, 2.01f, 0.012f, 0.01f, 2.01f}, {1, 2}};
  KlOccupancy occupancy;
  probabilities(occupancy, points.frame());
  points.xyz[2] = points.xyz[5] = 1.51f;
  EXPECT_GT(probabilities(occupancy, points.frame())[0], 0.9f);
}

TEST(KlOccupancy, PaperProfileHasNoRangeFloor) {
  const Tracked points{{0.001f, 0, 0.51f, 0.001f, 0, 0.57f}, {}};
  KlOccupancyParams params;
  params.range_floor_cells = 0.0;
  KlOccupancy paper(params);
  KlOccupancy ours;
  EXPECT_LT(probabilities(paper, points.frame())[0], 0.01f);
  EXPECT_GT(probabilities(ours, points.frame())[0], 0.5f);
}

TEST(KlOccupancy, PointOrderDoesNotMatter) {
  Random random(4);
  Tracked points;
  for (int i = 0; i < 500; ++i) {
    for (int k = 0; k < 2; ++k) points.xyz.push_back(static_cast<float>(random.uniform(-1, 1)));
    points.xyz.push_back(static_cast<float>(random.uniform(1, 3)));
    points.tracks.push_back(i % 5 == 0 ? i : -1);
  }
  Tracked reversed;
  reversed.tracks.assign(points.tracks.rbegin(), points.tracks.rend());
  for (int i = 499; i >= 0; --i)
    reversed.xyz.insert(reversed.xyz.end(), &points.xyz[3 * i], &points.xyz[3 * i] + 3);
  KlOccupancy first;
  KlOccupancy second;
  const auto p = probabilities(first, points.frame());
  const auto q = probabilities(second, reversed.frame());
  for (int i = 0; i < 500; ++i) EXPECT_NEAR(p[i], q[499 - i], 1e-6) << i;
}

TEST(KlOccupancy, BeliefsStayInRangeOverFramesOfHostileInput) {
  Random random(5);
  KlOccupancy occupancy;
  for (int round = 0; round < 20; ++round) {
    Tracked points;
    for (int i = 0; i < 200; ++i) {
      for (int k = 0; k < 3; ++k) {
        const float scales[] = {1.0f, 1e9f, 3e38f, std::numeric_limits<float>::quiet_NaN(),
                                std::numeric_limits<float>::infinity()};
        points.xyz.push_back(scales[random.below(i % 4 == 0 ? 5 : 1)] *
                             static_cast<float>(random.uniform(-1, 1)));
      }
      points.tracks.push_back(static_cast<std::int64_t>(random.below(150)) - 10);
    }
    OccupancyFrame frame = points.frame();
    if (round % 2) frame.motion = FrameMotion();
    for (const float p : probabilities(occupancy, frame)) {
      ASSERT_GE(p, 0.0f);
      ASSERT_LE(p, 1.0f);
    }
  }
}

TEST(KlOccupancy, BadInputChangesNoBelief) {
  const Tracked points{{0, 0, 2}, {1}};
  KlOccupancy occupancy;
  const OccupancyFrame frame = points.frame();
  probabilities(occupancy, frame);
  OccupancyFrame bad = frame;
  const std::vector<std::int64_t> two{1, 2};
  bad.tracks = &two;
  EXPECT_THROW(probabilities(occupancy, bad), InputError);
  bad = frame;
  const std::vector<std::int32_t> none;
  bad.plane_labels = &none;
  EXPECT_THROW(probabilities(occupancy, bad), InputError);
  bad = frame;
  for (const int outside : {1, -1}) {
    const Indices indices{outside};
    bad.indices = &indices;
    EXPECT_THROW(probabilities(occupancy, bad), InputError);
  }
  EXPECT_DOUBLE_EQ(*occupancy.tracks().belief(1), 0.5);
  EXPECT_EQ(occupancy.tracks().frames(), 1u);
}

}  // namespace
}  // namespace planar_mapping
