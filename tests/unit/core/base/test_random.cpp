// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/base/detail/random.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace planar_mapping {
namespace {

// The published demo of PCG32: pcg32_srandom(42, 54).
TEST(Random, MatchesThePublishedSequence) {
  Random random(42, 54);
  for (const std::uint32_t expected :
       {0xa15c02b7u, 0x7b47f409u, 0xba1d3330u, 0x83d2f293u, 0xbfa4784bu, 0xcbed606eu}) {
    EXPECT_EQ(random.next(), expected);
  }
}

TEST(Random, SameSeedGivesTheSameNumbers) {
  Random a(7), b(7), other_seed(8), other_stream(7, 1);
  int same_seed = 0, same_stream = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::uint32_t value = a.next();
    EXPECT_EQ(value, b.next());
    same_seed += value == other_seed.next();
    same_stream += value == other_stream.next();
  }
  EXPECT_LE(same_seed, 2);
  EXPECT_LE(same_stream, 2);
}

TEST(Random, BelowIsEvenAndInRange) {
  Random random(1);
  std::array<int, 10> counts{};
  for (int i = 0; i < 100000; ++i) ++counts[random.below(10)];
  for (const int count : counts) EXPECT_NEAR(count, 10000, 500);
  EXPECT_EQ(random.below(1), 0u);
  for (int i = 0; i < 100; ++i) EXPECT_LT(random.below(4294967295u), 4294967295u);
}

TEST(Random, UniformStaysInItsInterval) {
  Random random(2);
  double sum = 0.0;
  for (int i = 0; i < 100000; ++i) {
    const double value = random.uniform(-3.0, 5.0);
    ASSERT_GE(value, -3.0);
    ASSERT_LT(value, 5.0);
    sum += value;
  }
  EXPECT_NEAR(sum / 100000, 1.0, 0.05);
}

TEST(Random, NormalHasUnitVarianceAndLightTails) {
  Random random(3);
  double sum = 0.0, squares = 0.0;
  int beyond_two = 0;
  constexpr int kDraws = 100000;
  for (int i = 0; i < kDraws; ++i) {
    const double value = random.normal();
    ASSERT_TRUE(std::isfinite(value));
    sum += value;
    squares += value * value;
    beyond_two += std::abs(value) > 2.0;
  }
  EXPECT_NEAR(sum / kDraws, 0.0, 0.02);
  EXPECT_NEAR(squares / kDraws, 1.0, 0.02);
  EXPECT_NEAR(beyond_two / double(kDraws), 0.0455, 0.004);
}

}  // namespace
}  // namespace planar_mapping
