// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/detail/belief_update.h"

#include <gtest/gtest.h>

#include <cmath>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/occupancy/feature_beliefs.h"

namespace planar_mapping {
namespace {

BeliefUpdateParams with(UpdateRule rule) {
  BeliefUpdateParams params;
  params.rule = rule;
  return params;
}

TEST(BeliefUpdate, TheRuleOfThePaperIsEquation10) {
  const BeliefUpdateParams params;
  EXPECT_EQ(params.rule, UpdateRule::KullbackLeibler);
  EXPECT_DOUBLE_EQ(firstBelief(0.9, params), 0.9);
  // p = 0.9, q = 1 * 0.5: exp(-0.9 ln 1.8)
  EXPECT_NEAR(nextBelief(0.9, 1.0, 0.5, params), 0.5892, 1e-4);
  EXPECT_NEAR(nextBelief(0.9, 0.5, 1.0, params), 0.5892, 1e-4);
  EXPECT_NEAR(nextBelief(0.5, 0.5, 1.0, params), std::exp(-1.07), 1e-9);
}

TEST(BeliefUpdate, LogOddsCountsHitsAndMisses) {
  const BeliefUpdateParams params = with(UpdateRule::LogOdds);
  EXPECT_NEAR(firstBelief(0.9, params), 0.7, 1e-12);
  EXPECT_NEAR(firstBelief(0.3, params), 0.4, 1e-12);
  EXPECT_NEAR(nextBelief(0.7, 0.9, 1.0, params), 49.0 / 58.0, 1e-12);
  // A good feature where the motion does not let it be is a miss.
  EXPECT_NEAR(nextBelief(0.7, 0.9, 0.1, params), 14.0 / 23.0, 1e-12);
}

TEST(BeliefUpdate, NoneForgetsWhatWas) {
  const BeliefUpdateParams params = with(UpdateRule::None);
  EXPECT_DOUBLE_EQ(firstBelief(0.3, params), 0.3);
  EXPECT_DOUBLE_EQ(nextBelief(0.9, 0.3, 0.0, params), 0.3);
}

TEST(BeliefUpdate, FeaturesFollowTheRuleChosen) {
  FeatureBeliefParams params;
  params.update = with(UpdateRule::LogOdds);
  FeatureBeliefs beliefs(params);
  beliefs.update({{1, {0, 0, 2}, 0.9}});
  beliefs.update({{1, {0, 0, 2}, 0.9}});
  EXPECT_NEAR(*beliefs.belief(1), 49.0 / 58.0, 1e-12);
  params.update.log_odds.miss = 0.6;
  EXPECT_THROW(beliefs.setParams(params), ParameterError);
}

TEST(BeliefUpdate, RejectsBadValues) {
  const double nan = std::nan("");
  for (const UpdateRule rule :
       {UpdateRule::KullbackLeibler, UpdateRule::LogOdds, UpdateRule::None}) {
    EXPECT_THROW(firstBelief(nan, with(rule)), ParameterError);
    EXPECT_THROW(nextBelief(0.5, 1.1, 1.0, with(rule)), ParameterError);
    EXPECT_THROW(nextBelief(0.5, 0.5, nan, with(rule)), ParameterError);
  }
  EXPECT_THROW(nextBelief(-0.1, 0.5, 1.0), ParameterError);
}

}  // namespace
}  // namespace planar_mapping
