// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/detail/belief_update.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

TEST(LogOdds, IsTheLogarithmOfTheOdds) {
  EXPECT_DOUBLE_EQ(logOdds(0.5), 0.0);
  EXPECT_NEAR(logOdds(0.8), std::log(4.0), 1e-12);
  EXPECT_NEAR(logOdds(0.2), -std::log(4.0), 1e-12);
  EXPECT_NEAR(probabilityOfLogOdds(std::log(4.0)), 0.8, 1e-12);
  EXPECT_DOUBLE_EQ(probabilityOfLogOdds(std::numeric_limits<double>::infinity()), 1.0);
  EXPECT_DOUBLE_EQ(probabilityOfLogOdds(-std::numeric_limits<double>::infinity()), 0.0);
}

// Odds by hand: a hit of 0.7 multiplies them by 7/3, a miss of 0.4 by 2/3.
TEST(LogOdds, HitsAndMissesMultiplyTheOdds) {
  EXPECT_NEAR(logOddsUpdate(0.5, true), 7.0 / 10.0, 1e-12);
  EXPECT_NEAR(logOddsUpdate(0.7, true), 49.0 / 58.0, 1e-12);
  EXPECT_NEAR(logOddsUpdate(0.5, false), 2.0 / 5.0, 1e-12);
  EXPECT_NEAR(logOddsUpdate(0.7, false), 14.0 / 23.0, 1e-12);
}

TEST(LogOdds, ThePriorIsTakenOff) {
  LogOddsParams params;
  params.prior = 0.4;  // odds 2/3: a hit multiplies by (7/3) / (2/3) = 7/2
  EXPECT_NEAR(logOddsUpdate(0.5, true, params), 7.0 / 9.0, 1e-12);
}

TEST(LogOdds, StaysBetweenTheClamps) {
  double belief = 0.5;
  for (int i = 0; i < 100; ++i) belief = logOddsUpdate(belief, true);
  EXPECT_DOUBLE_EQ(belief, 0.971);
  // Odds 33.48 at the upper clamp: (3/2)^8 = 25.6 is less, (3/2)^9 = 38.4 is more.
  int misses = 0;
  for (; belief >= 0.5; ++misses) belief = logOddsUpdate(belief, false);
  EXPECT_EQ(misses, 9);
  for (int i = 0; i < 100; ++i) belief = logOddsUpdate(belief, false);
  EXPECT_DOUBLE_EQ(belief, 0.1192);
  EXPECT_GT(logOddsUpdate(0.0, true), 0.1192);
  EXPECT_LT(logOddsUpdate(1.0, false), 0.971);
}

TEST(LogOdds, RejectsBadValues) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {nan, 0.0, 1.0, -0.1, 1.1}) EXPECT_THROW(logOdds(bad), ParameterError);
  EXPECT_THROW(probabilityOfLogOdds(nan), ParameterError);
  for (const double bad : {nan, -0.1, 1.1}) EXPECT_THROW(logOddsUpdate(bad, true), ParameterError);
  const auto rejects = [](auto&& spoil) {
    LogOddsParams params;
    spoil(params);
    EXPECT_THROW(params.validate(), ParameterError);
  };
  rejects([](LogOddsParams& p) { p.prior = 0.0; });
  rejects([](LogOddsParams& p) { p.hit = 0.5; });
  rejects([](LogOddsParams& p) { p.miss = 0.5; });
  rejects([](LogOddsParams& p) { p.min_probability = 0.5; });
  rejects([](LogOddsParams& p) { p.max_probability = 1.0; });
  rejects([&](LogOddsParams& p) { p.hit_threshold = nan; });
}

}  // namespace
}  // namespace planar_mapping
