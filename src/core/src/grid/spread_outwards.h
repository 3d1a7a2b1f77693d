// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

namespace planar_mapping::detail {

/// Gives cells without a value (-1) the mean over their neighbours that have one, ring by ring.
/// \param ring       cells with a value that have neighbours without one
/// \param neighbours neighbours(cell, visit) calls visit(other) for each adjacent cell
template <typename Neighbours>
void spreadOutwards(std::vector<double>& values, std::vector<std::size_t> ring,
                    const Neighbours& neighbours) {
  std::vector<char> is_listed(values.size(), 0);
  while (!ring.empty()) {
    std::vector<std::size_t> next;
    for (const std::size_t cell : ring) {
      neighbours(cell, [&](std::size_t other) {
        if (values[other] >= 0.0 || is_listed[other] != 0) return;
        is_listed[other] = 1;
        next.push_back(other);
      });
    }
    // A ring takes its values from the rings before it, so the order of cells does not matter.
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
