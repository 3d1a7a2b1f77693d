// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// How many wrong cells survive wrong matches and flying pixels: docs/results.md has the table.
#include <gtest/gtest.h>

#include "occupancy_experiment.h"

namespace planar_mapping {
namespace {

using test::OutlierFrame;
using test::OutlierResult;
using test::runOutliers;
using test::Variant;

constexpr Variant kWithout{"none", true, UpdateRule::None, MotionReading::FeaturePosition};
constexpr Variant kFeature{"kl feature", true, UpdateRule::KullbackLeibler,
                           MotionReading::FeaturePosition};
constexpr Variant kPose{"kl pose", true, UpdateRule::KullbackLeibler, MotionReading::RobotPose};
constexpr Variant kLogOdds{"log-odds", true, UpdateRule::LogOdds, MotionReading::FeaturePosition};

TEST(Outliers, FewerWrongCellsSurviveWithTheUpdate) {
  for (const double wrong : {0.1, 0.2}) {
    const std::vector<OutlierFrame> frames = test::outlierFrames(wrong);
    const OutlierResult without = runOutliers(frames, 0.7, kWithout);
    const OutlierResult with = runOutliers(frames, 0.7, kFeature);
    const OutlierResult classical = runOutliers(frames, 0.7, kLogOdds);
    RecordProperty("without", static_cast<int>(without.wrong));
    RecordProperty("with", static_cast<int>(with.wrong));
    RecordProperty("log_odds", static_cast<int>(classical.wrong));
    EXPECT_LE(with.wrong, 0.75 * static_cast<double>(without.wrong)) << wrong;
    EXPECT_LE(with.wrong, 0.85 * static_cast<double>(classical.wrong)) << wrong;
    EXPECT_LE(classical.wrong, without.wrong) << wrong;
    // Not won by leaving things out.
    EXPECT_GT(with.completeness, 0.88) << wrong;
    EXPECT_GT(without.completeness, 0.99) << wrong;
  }
}

TEST(Outliers, TheReadingByFeaturesLeavesMoreOfTheSurfaceThanThatByPose) {
  const std::vector<OutlierFrame> frames = test::outlierFrames(0.1);
  const OutlierResult feature = runOutliers(frames, 0.7, kFeature);
  const OutlierResult pose = runOutliers(frames, 0.7, kPose);
  EXPECT_GE(feature.completeness, pose.completeness + 0.2);
}

}  // namespace
}  // namespace planar_mapping
