// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/base/detail/marked_positions.h"

#include <gtest/gtest.h>

#include <vector>

#include "planar_mapping/core/base/detail/random.h"
#include "random_marks.h"

namespace planar_mapping::detail {
namespace {

template <typename Number>
void expectListed(Number first) {
  Random random(3);
  for (std::size_t n = 0; n < 200; ++n) {
    const std::vector<std::uint8_t> marks = test::randomMarks(random, n);
    std::vector<Number> expected;
    for (std::size_t i = 0; i < n; ++i) {
      if (marks[i] == 1) expected.push_back(static_cast<Number>(first + i));
    }
    std::vector<Number> listed(expected.size() + 1);
    const Number* last = listMarked(marks.data(), n, first, listed.data());
    listed.resize(static_cast<std::size_t>(last - listed.data()));
    EXPECT_EQ(listed, expected) << n;
  }
}

TEST(ListMarked, ListsThePositionsOfTheMarkedOnes) {
  expectListed<std::uint16_t>(0);
  expectListed<int>(100000);
}

}  // namespace
}  // namespace planar_mapping::detail
