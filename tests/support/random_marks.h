// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping::test {

/// Marks of 0 and 1 in runs, as those of points side by side are.
inline std::vector<std::uint8_t> randomMarks(Random& random, std::size_t n) {
  std::vector<std::uint8_t> marks;
  while (marks.size() < n) {
    marks.insert(marks.end(), 1 + random.below(30), static_cast<std::uint8_t>(random.below(2)));
  }
  marks.resize(n);
  return marks;
}

}  // namespace planar_mapping::test
