// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <numeric>

#include "planes/tiles/organized_growing.h"

namespace planar_mapping::detail {
namespace {

constexpr int kReach = 2;  ///< cells within which planes are adjacent: one between them is an edge

/// The planes that each plane is adjacent to.
std::vector<std::vector<std::int16_t>> adjacentPlanes(const std::vector<std::int16_t>& labels,
                                                      int columns, int rows, std::size_t planes) {
  std::vector<std::vector<std::int16_t>> adjacent(planes);
  const auto add = [&](std::int16_t plane, std::int16_t other) {
    std::vector<std::int16_t>& list = adjacent[static_cast<std::size_t>(plane)];
    if (std::find(list.begin(), list.end(), other) == list.end()) list.push_back(other);
  };
  for (int row = 0; row < rows; ++row) {
    const std::int16_t* line = labels.data() + static_cast<std::size_t>(row) * columns;
    const int below = std::min(kReach, rows - 1 - row);
    for (int column = 0; column < columns; ++column) {
      const std::int16_t label = line[column];
      if (label < 0) continue;
      for (int r = 0; r <= below; ++r) {
        const int left = r == 0 ? column + 1 : std::max(0, column - kReach);
        for (int c = left; c <= std::min(columns - 1, column + kReach); ++c) {
          const std::int16_t other = line[r * columns + c];
          if (other < 0 || other == label) continue;
          add(label, other);
          add(other, label);
        }
      }
    }
  }
  return adjacent;
}

}  // namespace

std::vector<std::int16_t> mergeCandidates(std::vector<PlaneCandidate>& planes,
                                          const std::vector<std::int16_t>& labels, int columns,
                                          int rows, const PlaneFit& fit) {
  const std::size_t count = planes.size();
  std::vector<std::int16_t> target(count);
  std::iota(target.begin(), target.end(), std::int16_t{0});
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return planes[a].sums[kN] > planes[b].sums[kN] ||
           (planes[a].sums[kN] == planes[b].sums[kN] && a < b);
  });
  std::vector<std::vector<std::int16_t>> adjacent = adjacentPlanes(labels, columns, rows, count);
  const auto touches = [&](std::size_t small, std::size_t large) {
    return std::any_of(adjacent[small].begin(), adjacent[small].end(), [&](std::int16_t other) {
      return target[static_cast<std::size_t>(other)] == static_cast<std::int16_t>(large);
    });
  };
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t small = order[i];
    if (!planes[small].valid) continue;
    PlaneCandidate joined;
    const auto isOneWith = [&](std::size_t large) {
      return planes[large].valid && target[large] == static_cast<std::int16_t>(large) &&
             fit.areOne(planes[large], planes[small], touches(small, large), joined);
    };
    const auto found =
        std::find_if(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(i), isOneWith);
    if (found == order.begin() + static_cast<std::ptrdiff_t>(i)) continue;
    const std::size_t large = *found;
    planes[large] = joined;
    planes[small].valid = false;
    target[small] = static_cast<std::int16_t>(large);
    // What the small one was adjacent to is adjacent to the large one now.
    adjacent[large].insert(adjacent[large].end(), adjacent[small].begin(), adjacent[small].end());
  }
  return target;
}

}  // namespace planar_mapping::detail
