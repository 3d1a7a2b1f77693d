// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/kl_occupancy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping {
namespace {

PointsView viewOf(const std::vector<float>& xyz) {
  return {xyz.data(), xyz.size() / 3};
}

TEST(KlOccupancy, TrackedFeaturesFollowTheirHistory) {
  // Two features in one cell at the same range: Eq. 4 gives 1 to both.
  const std::vector<float> xyz{0.01f, 0, 2, -0.01f, 0, 2};
  const std::vector<std::int64_t> tracks{3, 4};
  const std::vector<std::int32_t> groups{0, 0};
  KlOccupancy occupancy;
  OccupancyFrame frame;
  frame.points = viewOf(xyz);
  frame.tracks = &tracks;
  frame.groups = &groups;
  EXPECT_EQ(occupancy.process(frame), (std::vector<float>{1.0f, 1.0f}));
  frame.motion = FrameMotion();
  const auto again = occupancy.process(frame);
  EXPECT_NEAR(again[0], 1.0f, 1e-5f);
  EXPECT_EQ(occupancy.beliefs().size(), 2u);
}

TEST(KlOccupancy, LonelyTrackLosesBeliefAsEquation10Says) {
  const std::vector<float> xyz{0, 0, 2};
  const std::vector<std::int64_t> tracks{1};
  KlOccupancy occupancy;
  OccupancyFrame frame;
  frame.points = viewOf(xyz);
  frame.tracks = &tracks;
  frame.motion = FrameMotion();
  EXPECT_FLOAT_EQ(occupancy.process(frame)[0], 0.5f);
  EXPECT_NEAR(occupancy.process(frame)[0], std::exp(-1.07), 1e-5);
}

TEST(KlOccupancy, UntrackedPointsTakeTheFeaturesOfTheirCell) {
  const std::vector<float> xyz{0.05f, 0.05f, 2.05f, 0.06f, 0.06f, 2.05f,
                               0.15f, 0.05f, 2.05f, 5.0f,  0.0f,  2.0f};
  const std::vector<std::int64_t> tracks{1, -1, -1, -1};
  KlOccupancyParams params;
  params.beliefs.occupancy.single_feature_probability = 0.7;
  KlOccupancy occupancy(params);
  OccupancyFrame frame;
  frame.points = viewOf(xyz);
  frame.tracks = &tracks;
  KlOccupancyDiagnostics diagnostics;
  const auto p = occupancy.process(frame, &diagnostics);
  for (const float value : p) EXPECT_FLOAT_EQ(value, 0.7f);
  EXPECT_EQ(diagnostics.tracked, 1u);
  EXPECT_EQ(diagnostics.from_features, 2u);
  EXPECT_EQ(diagnostics.from_dense_support, 1u);
}

TEST(KlOccupancy, GroupsReplaceTheGrid) {
  const std::vector<float> xyz{0, 0, 2, 9, 9, 9, 1, 1, 1};
  const std::vector<std::int64_t> tracks{1, -1, -1};
  const std::vector<std::int32_t> groups{4, 4, 5};
  KlOccupancyParams params;
  params.beliefs.occupancy.single_feature_probability = 0.8;
  KlOccupancy occupancy(params);
  OccupancyFrame frame;
  frame.points = viewOf(xyz);
  frame.tracks = &tracks;
  frame.groups = &groups;
  KlOccupancyDiagnostics diagnostics;
  occupancy.process(frame, &diagnostics);
  EXPECT_EQ(diagnostics.from_features, 1u);
  EXPECT_EQ(diagnostics.from_dense_support, 1u);
}

TEST(KlOccupancy, PaperProfileHasNoRangeFloor) {
  const std::vector<float> xyz{0.001f, 0, 0.51f, 0.001f, 0, 0.57f};
  KlOccupancyParams params;
  params.range_floor_cells = 0.0;
  OccupancyFrame frame;
  frame.points = viewOf(xyz);
  EXPECT_LT(KlOccupancy(params).process(frame)[0], 0.01f);
  EXPECT_GT(KlOccupancy().process(frame)[0], 0.5f);
}

TEST(KlOccupancy, PointOrderDoesNotMatter) {
  Random random(4);
  std::vector<float> xyz;
  std::vector<std::int64_t> tracks;
  for (int i = 0; i < 500; ++i) {
    for (int k = 0; k < 2; ++k) xyz.push_back(static_cast<float>(random.uniform(-1, 1)));
    xyz.push_back(static_cast<float>(random.uniform(1, 3)));
    tracks.push_back(i % 5 == 0 ? i : -1);
  }
  std::vector<float> reversed_xyz;
  std::vector<std::int64_t> reversed_tracks(tracks.rbegin(), tracks.rend());
  for (int i = 499; i >= 0; --i) {
    reversed_xyz.insert(reversed_xyz.end(), &xyz[3 * i], &xyz[3 * i] + 3);
  }
  OccupancyFrame frame;
  frame.points = viewOf(xyz);
  frame.tracks = &tracks;
  const auto p = KlOccupancy().process(frame);
  frame.points = viewOf(reversed_xyz);
  frame.tracks = &reversed_tracks;
  const auto q = KlOccupancy().process(frame);
  for (int i = 0; i < 500; ++i) EXPECT_NEAR(p[i], q[499 - i], 1e-6) << i;
}

TEST(KlOccupancy, BeliefsStayInRangeOverFramesOfHostileInput) {
  Random random(5);
  KlOccupancy occupancy;
  for (int round = 0; round < 20; ++round) {
    std::vector<float> xyz;
    std::vector<std::int64_t> tracks;
    for (int i = 0; i < 200; ++i) {
      for (int k = 0; k < 3; ++k) {
        const float scales[] = {1.0f, 1e9f, 3e38f, std::numeric_limits<float>::quiet_NaN(),
                                std::numeric_limits<float>::infinity()};
        xyz.push_back(scales[random.below(i % 4 == 0 ? 5 : 1)] *
                      static_cast<float>(random.uniform(-1, 1)));
      }
      tracks.push_back(static_cast<std::int64_t>(random.below(150)) - 10);
    }
    OccupancyFrame frame;
    frame.points = viewOf(xyz);
    frame.tracks = &tracks;
    if (round % 2) frame.motion = FrameMotion();
    for (const float p : occupancy.process(frame)) {
      ASSERT_GE(p, 0.0f);
      ASSERT_LE(p, 1.0f);
    }
  }
}

TEST(KlOccupancy, BadInputChangesNoBelief) {
  const std::vector<float> xyz{0, 0, 2};
  const std::vector<std::int64_t> tracks{1};
  KlOccupancy occupancy;
  OccupancyFrame frame;
  frame.points = viewOf(xyz);
  frame.tracks = &tracks;
  occupancy.process(frame);
  OccupancyFrame bad = frame;
  const std::vector<std::int64_t> two{1, 2};
  bad.tracks = &two;
  EXPECT_THROW(occupancy.process(bad), InputError);
  bad = frame;
  const Indices outside{1};
  bad.indices = &outside;
  EXPECT_THROW(occupancy.process(bad), InputError);
  bad = frame;
  bad.sensor.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(occupancy.process(bad), InputError);
  EXPECT_DOUBLE_EQ(*occupancy.beliefs().belief(1), 0.5);
  EXPECT_EQ(occupancy.beliefs().frames(), 1u);
}

TEST(KlOccupancy, AcceptsAnEmptyFrame) {
  KlOccupancy occupancy;
  EXPECT_TRUE(occupancy.process(OccupancyFrame()).empty());
}

}  // namespace
}  // namespace planar_mapping
