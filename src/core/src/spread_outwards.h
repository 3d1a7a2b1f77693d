// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace planar_mapping::detail {

/// Gives cells without a value (-1) the mean over their neighbours that have one, ring by ring.
/// \param neighbours neighbours(cell, visit) calls visit(other) for each adjacent cell
template <typename Neighbours>
void spreadOutwards(std::vector<double>& values, const Neighbours& neighbours) {
  std::vector<std::size_t> ring;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] >= 0.0) ring.push_back(i);
  }
  while (!ring.empty()) {
    std::vector<std::size_t> next;
    for (const std::size_t cell : ring) {
      neighbours(cell, [&](std::size_t other) {
        if (values[other] < 0.0) next.push_back(other);
      });
    }
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    // All of a ring are judged by the rings before it, so the order of cells does not matter.
    std::vector<double> means(next.size());
    for (std::size_t i = 0; i < next.size(); ++i) {
      double sum = 0.0;
      int count = 0;
      neighbours(next[i], [&](std::size_t other) {
        if (values[other] < 0.0) return;
        sum += values[other];
        ++count;
      });
      means[i] = sum / count;
    }
    for (std::size_t i = 0; i < next.size(); ++i) values[next[i]] = means[i];
    ring.swap(next);
  }
}

}  // namespace planar_mapping::detail
