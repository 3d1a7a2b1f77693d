// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/base/detail/marked_indices.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "planar_mapping/core/base/detail/random.h"
#include "random_marks.h"

namespace planar_mapping::detail {
namespace {

TEST(CopyMarked, KeepsTheMarkedOnesInOrder) {
  Random random(2);
  for (std::size_t n = 0; n < 300; ++n) {
    const std::vector<std::uint8_t> marks = test::randomMarks(random, n);
    std::vector<int> indices(n);
    std::iota(indices.begin(), indices.end(), 1000);
    for (const std::uint8_t wanted : {0, 1}) {
      std::vector<int> expected;
      for (std::size_t i = 0; i < n; ++i) {
        if (marks[i] == wanted) expected.push_back(indices[i]);
      }
      std::vector<int> copied(expected.size() + 1);
      copied.resize(static_cast<std::size_t>(
          copyMarked(indices.data(), marks.data(), n, wanted, copied.data()) - copied.data()));
      EXPECT_EQ(copied, expected) << n;
      std::vector<int> in_place = indices;
      in_place.resize(static_cast<std::size_t>(
          copyMarked(in_place.data(), marks.data(), n, wanted, in_place.data()) - in_place.data()));
      EXPECT_EQ(in_place, expected) << n;
    }
  }
}

}  // namespace
}  // namespace planar_mapping::detail
