// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cell_beliefs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

namespace planar_mapping::detail {
namespace {

/// Depth is the range and dr is 0.1 m at any: values by hand from Eq. 4.
CellBeliefParams params() {
  CellBeliefParams params;
  params.resolution = 1.0;
  params.occupancy.optical_axis = Vector3::Zero();
  params.occupancy.noise.disparity_error = 0.0;
  params.occupancy.min_range_error = 0.1;
  return params;
}

class Frames {
 public:
  explicit Frames(const CellBeliefParams& of) { beliefs_.setParams(of); }
  std::vector<float> see(const std::vector<float>& xyz, std::vector<std::int32_t> labels = {},
                         const Pose& pose = Pose::Identity()) {
    labels.resize(xyz.size() / 3, -1);
    Indices indices(labels.size());
    std::iota(indices.begin(), indices.end(), 0);
    std::vector<float> probability(labels.size(), -1.0f);
    const PointsView points(xyz.data(), labels.size(), 3);
    summary_ = beliefs_.update(points, indices, labels, pose, probability);
    return probability;
  }
  const CellBeliefs::Summary& summary() const { return summary_; }

 private:
  CellBeliefs beliefs_;
  CellBeliefs::Summary summary_;
};

TEST(CellBeliefs, AloneInItsCellAFeatureGetsTheSingleProbability) {
  Frames frames(params());
  EXPECT_EQ((std::vector<float>{0.5f}), frames.see({1.5f, 0.5f, 0.5f}));
  EXPECT_EQ(1u, frames.summary().created);
}

TEST(CellBeliefs, SpreadOfTheRangeLowersTheBelief) {
  Frames frames(params());
  // Ranges 1.2 and 1.4: 0.1 from their mean each, which is one dr.
  const std::vector<float> seen = frames.see({1.2f, 0.0f, 0.0f, 1.4f, 0.0f, 0.0f});
  EXPECT_NEAR(std::exp(-0.5), seen[0], 1e-5);
  EXPECT_EQ(seen[0], seen[1]);
}

TEST(CellBeliefs, TwoPlanesInACellAreTwoGroups) {
  Frames frames(params());
  const std::vector<float> seen = frames.see(
      {1.2f, 0.0f, 0.0f, 1.2f, 0.0f, 0.0f, 1.8f, 0.0f, 0.0f, 1.8f, 0.0f, 0.0f}, {0, 0, 1, 1});
  for (const float p : seen) EXPECT_NEAR(1.0f, p, 1e-5);
}

TEST(CellBeliefs, SeenAgainACellFollowsTheDivergence) {
  Frames frames(params());
  EXPECT_EQ(0.5f, frames.see({1.5f, 0.5f, 0.5f})[0]);
  // p = q = 0.5: exp(-A) with A = 1.07 (Eq. 10).
  EXPECT_NEAR(std::exp(-1.07), frames.see({1.5f, 0.5f, 0.5f})[0], 1e-5);
  EXPECT_EQ(1u, frames.summary().updated);
}

TEST(CellBeliefs, TheCellIsOfTheWorldAlsoFarFromTheOrigin) {
  for (const double away : {0.0, -7.25, 4000.5, 1.5e6, 1e14}) {
    Frames frames(params());
    Pose pose = Pose::Identity();
    pose.translation() = Vector3(away, -away, 0.0);
    frames.see({1.5f, 0.5f, 0.5f}, {}, pose);
    pose.translation().x() += 1.0;
    frames.see({0.5f, 0.5f, 0.5f}, {}, pose);
    EXPECT_EQ(1u, frames.summary().updated) << away;
    frames.see({-1.5f, 0.5f, 0.5f}, {}, pose);
    EXPECT_EQ(1u, frames.summary().created) << away;
  }
}

TEST(CellBeliefs, UnseenCellsAreForgottenAfterSoManyFrames) {
  CellBeliefParams forgetful = params();
  forgetful.max_unseen_frames = 1;
  Frames frames(forgetful);
  const std::vector<float> here{1.5f, 0.5f, 0.5f};
  const std::vector<float> there{5.5f, 0.5f, 0.5f};
  frames.see(here);
  frames.see(there);
  frames.see(here);
  EXPECT_EQ(1u, frames.summary().updated);  // unseen for one frame only
  frames.see(there);
  frames.see(there);
  frames.see(here);
  EXPECT_EQ(1u, frames.summary().created);
}

TEST(CellBeliefs, FeaturesBeyondTheSampleDoNotCountButGetTheBelief) {
  CellBeliefParams sparse = params();
  sparse.features_per_cell = 2;
  Frames frames(sparse);
  const std::vector<float> seen =
      frames.see({1.5f, 0.0f, 0.0f, 1.5f, 0.0f, 0.0f, 1.9f, 0.0f, 0.0f});
  EXPECT_NEAR(1.0f, seen[2], 1e-5);
}

TEST(CellBeliefs, WhatNoGridHoldsIsALonelyFeature) {
  Frames frames(params());
  const float infinite = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float p : frames.see({1e9f, 0, 0, 0, -1e12f, 0, infinite, 0, 0, 0, nan, 0})) {
    EXPECT_EQ(0.5f, p);
  }
  EXPECT_EQ(0u, frames.summary().created);
  EXPECT_TRUE(frames.see({}).empty());
}

TEST(CellBeliefs, ManyCellsInManyFramesKeepTheirBeliefs) {
  Frames frames(params());
  std::vector<float> xyz;
  for (int i = 0; i < 20000; ++i) {
    const auto x = static_cast<float>(i % 200);
    const auto y = static_cast<float>(i / 200);
    xyz.insert(xyz.end(), {x + 0.5f, y + 0.5f, 3.5f});
  }
  for (const float p : frames.see(xyz)) ASSERT_EQ(0.5f, p);
  for (const float p : frames.see(xyz)) ASSERT_NEAR(std::exp(-1.07), p, 1e-5);
  EXPECT_EQ(20000u, frames.summary().updated);
}

}  // namespace
}  // namespace planar_mapping::detail
