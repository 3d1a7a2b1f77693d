// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cell_values.h"

#include <gtest/gtest.h>

#include <map>

#include "planar_mapping/core/random.h"

namespace planar_mapping::detail {
namespace {

/// Cells come, change and go at random; a plain map says what their values are.
template <unsigned kBits>
void expectValuesOfAPlainMap(std::uint64_t seed) {
  Random random(seed);
  constexpr int kLargest = (1 << kBits) - 1;
  for (int repetition = 0; repetition < 50; ++repetition) {
    CellValues<kBits> values;
    std::map<std::size_t, std::uint8_t> expected;
    std::uint64_t cells = 0;
    for (int step = 0; step < 300; ++step) {
      const auto bit = static_cast<std::size_t>(random.uniform(0.0, 64.0));
      // Mostly the ends of what there is, so that all are alike now and then.
      const double draw = random.uniform(0.0, 1.0);
      const auto value =
          static_cast<std::uint8_t>(draw < 0.4   ? kLargest
                                    : draw < 0.5 ? 0
                                                 : random.uniform(0.0, kLargest + 1.0));
      if (expected.count(bit) == 0) {
        values.insert(cells, bit, value);
        cells |= std::uint64_t{1} << bit;
        expected[bit] = value;
      } else if (random.uniform(0.0, 1.0) < 0.4) {
        values.remove(cells, bit);
        cells &= ~(std::uint64_t{1} << bit);
        expected.erase(bit);
      } else {
        values.set(cells, bit, value);
        expected[bit] = value;
      }
      const CellValues<kBits> copy(values);
      for (const auto& [at, wanted] : expected) {
        ASSERT_EQ(wanted, values.get(cells, at)) << "cell " << at << " after step " << step;
        ASSERT_EQ(wanted, copy.get(cells, at));
      }
    }
  }
}

TEST(CellValues, AreThoseOfAPlainMap) {
  expectValuesOfAPlainMap<5>(3);
  expectValuesOfAPlainMap<8>(4);
}

TEST(CellValues, TakeNothingWhileAllAreAlike) {
  CellValues<5> values;
  std::uint64_t cells = 0;
  for (std::size_t bit = 0; bit < 64; ++bit) {
    values.insert(cells, bit, 17);
    cells |= std::uint64_t{1} << bit;
  }
  EXPECT_EQ(0u, values.memoryBytes());
  values.set(cells, 20, 9);
  EXPECT_GT(values.memoryBytes(), 0u);
  EXPECT_LE(values.memoryBytes(), 64u);  // five bits each
  values.set(cells, 20, 17);
  EXPECT_EQ(0u, values.memoryBytes());
  values.set(cells, 20, 9);
  values.remove(cells, 20);
  EXPECT_EQ(0u, values.memoryBytes());
}

}  // namespace
}  // namespace planar_mapping::detail
