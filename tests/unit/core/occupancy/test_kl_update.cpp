// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/occupancy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

// Worked by hand from Eq. 10 with eta3 = 1, A = 1.07.
TEST(KlUpdate, MatchesHandWorkedValues) {
  EXPECT_NEAR(updatedBelief(0.9, 0.9), 1.0, 1e-12);
  EXPECT_NEAR(updatedBelief(0.5, 0.5), 0.34301, 1e-5);  // exp(-1.07)
  EXPECT_NEAR(updatedBelief(0.9, 0.5), 0.58919, 1e-5);  // 1.8^-0.9
  EXPECT_NEAR(updatedBelief(0.9, 0.1), 0.13842, 1e-5);  // 9^-0.9
  EXPECT_NEAR(updatedBelief(0.5, 0.9), 0.74536, 1e-5);  // (9/5)^-0.5
  EXPECT_NEAR(updatedBelief(0.2, 0.4), 0.29861, 1e-5);  // 2^-0.2 exp(-1.07)
  EXPECT_NEAR(updatedBelief(0.2, 0.8), 0.75786, 1e-5);  // 4^-0.2
}

TEST(KlUpdate, DivergenceIsOneTermOfTheSum) {
  EXPECT_NEAR(klDivergence(0.9, 0.5), 0.9 * std::log(1.8), 1e-12);
  EXPECT_NEAR(klDivergence(0.5, 0.9), -0.5 * std::log(1.8), 1e-12);
  EXPECT_EQ(klDivergence(0.3, 0.3), 0.0);
}

TEST(KlUpdate, BiasAppliesUpToAndIncludingOneHalf) {
  const double above = std::nextafter(0.5, 1.0);
  EXPECT_NEAR(updatedBelief(above, 0.5), 1.0, 1e-9);
  EXPECT_NEAR(updatedBelief(0.5, above), 1.0, 1e-9);
  EXPECT_NEAR(updatedBelief(0.5, 0.5), std::exp(-1.07), 1e-9);
}

TEST(KlUpdate, ObservedBeliefIsTheProductOfItsFactors) {
  KlUpdateParams params;
  params.eta2 = 0.5;
  EXPECT_DOUBLE_EQ(observedBelief(0.8, 0.25, params), 0.1);
  EXPECT_DOUBLE_EQ(observedBelief(0.8, 1.0), 0.8);
}

TEST(KlUpdate, SettlesAtCertaintyWhenTheFeatureIsConfirmed) {
  double belief = 0.7;
  for (int i = 0; i < 10; ++i) {
    const double next = updatedBelief(belief, 0.95);
    if (i > 2) {
      EXPECT_GT(next, 0.9);
    }
    belief = next;
  }
}

TEST(KlUpdate, FallsWhenTheFeatureIsContradicted) {
  EXPECT_LT(updatedBelief(0.95, 0.05), 0.1);
  EXPECT_LT(updatedBelief(0.4, 0.3), 0.4);
}

TEST(KlUpdate, GreaterDisagreementNeverGivesGreaterBelief) {
  for (double p = 0.55; p < 1.0; p += 0.05) {
    double before = 1.0;
    for (double q = p; q > 0.01; q -= 0.01) {
      const double belief = updatedBelief(p, q);
      EXPECT_LE(belief, before + 1e-12) << "p " << p << " q " << q;
      before = belief;
    }
  }
}

TEST(KlUpdate, StaysInRangeAtTheLimits) {
  Random random(3);
  for (int i = 0; i < 10000; ++i) {
    const double p = i < 4 ? i % 2 : random.uniform();
    const double q = i < 4 ? i / 2 : random.uniform();
    const double belief = updatedBelief(p, q);
    ASSERT_GE(belief, 0.0);
    ASSERT_LE(belief, 1.0);
    ASSERT_TRUE(std::isfinite(klDivergence(p, q)));
  }
}

TEST(KlUpdate, RejectsWhatIsNoProbability) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {nan, -0.01, 1.01}) {
    EXPECT_THROW(updatedBelief(bad, 0.5), ParameterError);
    EXPECT_THROW(updatedBelief(0.5, bad), ParameterError);
    EXPECT_THROW(observedBelief(bad, 0.5), ParameterError);
    EXPECT_THROW(observedBelief(0.5, bad), ParameterError);
  }
  KlUpdateParams params;
  params.clamp = 0.5;
  EXPECT_THROW(params.validate(), ParameterError);
  params = KlUpdateParams();
  params.bias = -1.0;
  EXPECT_THROW(params.validate(), ParameterError);
  params = KlUpdateParams();
  params.eta3 = 1.5;
  EXPECT_THROW(params.validate(), ParameterError);
}

}  // namespace
}  // namespace planar_mapping
