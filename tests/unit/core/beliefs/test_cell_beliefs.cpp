// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Beliefs of KlOccupancy whose features are sampled from the cloud.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/beliefs/kl_occupancy.h"

namespace planar_mapping {
namespace {

/// Depth is the range and dr is 0.1 m at any: values by hand from Eq. 4.
KlOccupancyParams params() {
  KlOccupancyParams params;
  params.source = FeatureSource::Cells;
  params.resolution = 1.0;
  params.range_floor_cells = 0.1;
  params.optical_axis = Vector3::Zero();
  params.beliefs.occupancy.noise.disparity_error = 0.0;
  return params;
}

class Frames {
 public:
  explicit Frames(const KlOccupancyParams& of) : occupancy_(of) {}
  std::vector<float> see(const std::vector<float>& xyz, std::vector<std::int32_t> labels = {},
                         const Pose& pose = Pose::Identity(), const Indices* indices = nullptr) {
    labels.resize(xyz.size() / 3, -1);
    OccupancyFrame frame;
    frame.points = PointsView(xyz.data(), labels.size());
    frame.indices = indices;
    frame.plane_labels = &labels;
    frame.T_world_sensor = pose;
    std::vector<float> probability;
    report_ = occupancy_.update(frame, probability);
    return probability;
  }
  const FeatureBeliefs::Summary& summary() const { return report_.beliefs; }
  const KlOccupancyDiagnostics& report() const { return report_; }
  KlOccupancy& occupancy() { return occupancy_; }

 private:
  KlOccupancy occupancy_;
  KlOccupancyDiagnostics report_;
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
  // Ranges 0.13 m from their mean: Eq. 4 gives exp(-0.845) = 0.43.
  const std::vector<float> apart = {1.2f, 0.0f, 0.0f, 1.46f, 0.0f, 0.0f};
  EXPECT_NEAR(std::exp(-0.845), frames.see(apart)[0], 1e-5);
  // p = q <= 0.5: exp(-A) with A = 1.07 (Eq. 10).
  EXPECT_NEAR(std::exp(-1.07), frames.see(apart)[0], 1e-5);
  EXPECT_EQ(1u, frames.summary().updated);
}

/// A wall at 3 m, 9 points in each cell of it or 1, and points alone before and far behind it.
TEST(CellBeliefs, AloneWhereTheCloudIsSparseAPointIsNotDoubted) {
  for (const int side : {1, 3}) {
    Frames frames(params());
    std::vector<float> xyz = {0.5f, 0.5f, 2.5f, 0.5f, 0.5f, 20.5f};
    for (int i = 0; i < 16 * side; ++i) {
      for (int j = 0; j < 16 * side; ++j) {
        const auto at = [side](int k) {
          return (static_cast<float>(k) + 0.5f) / static_cast<float>(side) - 8.0f;
        };
        xyz.insert(xyz.end(), {at(i), at(j), 3.2f});
      }
    }
    std::vector<std::int32_t> labels(xyz.size() / 3, 0);
    labels[0] = labels[1] = -1;
    EXPECT_EQ(0.5f, frames.see(xyz, labels)[0]);
    const std::vector<float> again = frames.see(xyz, labels);
    for (const std::size_t lone : {0, 1})
      EXPECT_NEAR(side == 1 ? 0.5 : std::exp(-1.07), again[lone], 1e-5) << lone;
    if (side == 1) {
      for (const float p : again) EXPECT_EQ(0.5f, p);
    }
  }
}

/// One feature is sampled in each cell, though many points are in it.
TEST(CellBeliefs, AFeatureOfAFullCellIsNotAlone) {
  KlOccupancyParams one = params();
  one.features_per_cell = 1;
  Frames frames(one);
  std::vector<float> xyz;
  for (int i = 0; i < 100; ++i) xyz.insert(xyz.end(), {0.01f * static_cast<float>(i), 0.5f, 3.5f});
  EXPECT_EQ(0.5f, frames.see(xyz)[0]);
  EXPECT_NEAR(std::exp(-1.07), frames.see(xyz)[0], 1e-5);
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
  KlOccupancyParams forgetful = params();
  forgetful.beliefs.max_unseen_frames = 1;
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
  KlOccupancyParams sparse = params();
  sparse.features_per_cell = 2;
  Frames frames(sparse);
  const std::vector<float> seen =
      frames.see({1.5f, 0.0f, 0.0f, 1.5f, 0.0f, 0.0f, 1.9f, 0.0f, 0.0f});
  EXPECT_NEAR(1.0f, seen[2], 1e-5);
}

TEST(CellBeliefs, WhatNoGridHoldsIsALonelyFeatureAndWhatIsNotFiniteNone) {
  Frames frames(params());
  const float infinite = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(frames.see({1e9f, 0, 0, 0, -1e12f, 0, infinite, 0, 0, 0, nan, 0}),
            (std::vector<float>{0.5f, 0.5f, 0.0f, 0.0f}));
  EXPECT_EQ(frames.report().points_not_measured, 2u);
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
  for (const float p : frames.see(xyz)) ASSERT_EQ(0.5f, p);
  EXPECT_EQ(20000u, frames.summary().updated);
}

/// The cell of a point of the world as one number.
std::int64_t trackOf(const Vector3& world, double resolution) {
  std::int64_t track = 0;
  for (int axis = 0; axis < 3; ++axis)
    track = 4096 * track + static_cast<std::int64_t>(std::floor(world[axis] / resolution)) + 2048;
  return track;
}

// Points of a scan line lie in long runs of one cell; shuffled, hardly two neighbours do.
TEST(CellBeliefs, RunsOfPointsInACellGetWhatTheyGetOneByOne) {
  constexpr std::size_t kPoints = 3000;  // several blocks of the loop, the last one not full
  std::vector<float> xyz;
  std::vector<std::int32_t> labels;
  Random random(11);
  for (std::size_t i = 0; i < kPoints; ++i) {
    const float x = 0.003f * static_cast<float>(i);
    const bool is_lost = i % 701 == 700;
    xyz.insert(xyz.end(), {is_lost ? std::numeric_limits<float>::quiet_NaN() : x,
                           0.2f * std::sin(x), 2.0f + 0.1f * static_cast<float>(random.normal())});
    labels.push_back(static_cast<std::int32_t>(i / 450) - 1);
  }
  KlOccupancyParams of = params();
  of.features_per_cell = 100000;  // the sample is then the same in any order
  Indices shuffled(kPoints);
  std::iota(shuffled.begin(), shuffled.end(), 0);
  for (std::size_t i = kPoints - 1; i > 0; --i)
    std::swap(shuffled[i], shuffled[random.below(static_cast<std::uint32_t>(i + 1))]);
  Frames first(of);
  Frames second(of);
  for (int frame = 0; frame < 2; ++frame) {
    const std::vector<float> expected = first.see(xyz, labels);
    const std::vector<float> found = second.see(xyz, labels, Pose::Identity(), &shuffled);
    for (std::size_t i = 0; i < kPoints; ++i) EXPECT_NEAR(found[i], expected[i], 1e-5) << i;
    EXPECT_EQ(expected[700], 0.0f);
  }
}

TEST(CellBeliefs, AreTheSameWithAnyNumberOfThreads) {
  // A scan in rows over a rough wall, of more points than one thread takes at a time.
  Random random(8);
  std::vector<float> xyz;
  std::vector<std::int32_t> labels;
  for (int i = 0; i < 150000; ++i) {
    const double along = 0.01 * (i % 1000);
    xyz.insert(xyz.end(), {static_cast<float>(along), static_cast<float>(0.02 * (i / 1000)),
                           static_cast<float>(4.0 + 0.02 * random.normal())});
    labels.push_back(i % 1000 < 300 ? -1 : 2);
  }
  KlOccupancyParams of = params();
  of.resolution = 0.1;
  of.range_floor_cells = 1.0;
  Frames one(of);
  const std::vector<float> first = one.see(xyz, labels);
  const std::vector<float> again = one.see(xyz, labels);
  for (const int threads : {2, 5}) {
    of.threads = threads;
    Frames several(of);
    EXPECT_EQ(several.see(xyz, labels), first);
    EXPECT_EQ(several.see(xyz, labels), again);
  }
}

// Two ways to one result: a cell of the world is the track of all points in it.
TEST(CellBeliefs, AgreesWithTracksUnderKnownPoses) {
  for (const UpdateRule rule :
       {UpdateRule::KullbackLeibler, UpdateRule::LogOdds, UpdateRule::None}) {
    KlOccupancyParams params;
    params.source = FeatureSource::Cells;
    // Exact in binary, so that both lay the same grid; no point is alone in its cell.
    params.resolution = 1.0;
    params.features_per_cell = 1000000;
    params.range_floor_cells = 0.2;
    params.beliefs.update.rule = rule;
    Frames cells(params);
    params.source = FeatureSource::Tracks;
    params.beliefs.motion_reading = MotionReading::RobotPose;
    KlOccupancy tracks(params);
    Random random(5);
    Pose pose = Pose::Identity();
    std::size_t low = 0;
    for (int frame = 0; frame < 6; ++frame) {
      pose.translation() = Vector3(1.0 * frame, -2.0 * frame, 1.0);
      std::vector<float> xyz;
      std::vector<std::int32_t> labels;
      std::vector<std::int64_t> track_of;
      for (int i = 0; i < 3000; ++i) {
        const bool on_wall = i % 3 != 0;
        const Vector3 p(random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0),
                        on_wall ? random.uniform(3.0, 3.1) : random.uniform(0.5, 4.0));
        for (int axis = 0; axis < 3; ++axis) xyz.push_back(static_cast<float>(p[axis]));
        labels.push_back(on_wall ? 0 : -1);
        const Vector3 rounded(xyz[xyz.size() - 3], xyz[xyz.size() - 2], xyz[xyz.size() - 1]);
        track_of.push_back(trackOf(pose * rounded, params.resolution));
      }
      const std::vector<float> by_cell = cells.see(xyz, labels, pose);
      OccupancyFrame of;
      of.points = PointsView(xyz.data(), xyz.size() / 3);
      of.tracks = &track_of;
      of.plane_labels = &labels;
      of.T_world_sensor = pose;
      std::vector<float> by_track;
      tracks.update(of, by_track);
      for (std::size_t i = 0; i < by_cell.size(); ++i) {
        ASSERT_NEAR(by_track[i], by_cell[i], 1e-6) << "frame " << frame << " point " << i;
        low += by_cell[i] < 0.5f ? 1 : 0;
      }
    }
    EXPECT_GT(low, 100u);  // not all the same
  }
}

TEST(CellBeliefs, CopiesAreIndependentAndResetForgets) {
  const std::vector<float> xyz{1.5f, 0.5f, 0.5f};
  Frames frames(params());
  frames.see(xyz);
  Frames copy = frames;
  copy.occupancy().reset();
  copy.see(xyz);
  EXPECT_EQ(copy.summary().created, 1u);
  frames.see(xyz);
  EXPECT_EQ(frames.summary().updated, 1u);
}

}  // namespace
}  // namespace planar_mapping
