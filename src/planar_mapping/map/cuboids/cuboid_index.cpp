// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/cuboids/cuboid_index.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace planar_mapping::detail {
namespace {

float roundedDown(double value) {
  const auto nearest = static_cast<float>(value);
  return static_cast<double>(nearest) <= value ? nearest : std::nextafter(nearest, -INFINITY);
}
float roundedUp(double value) {
  return -roundedDown(-value);
}

}  // namespace

void CuboidIndex::build(const std::vector<Cuboid>& cuboids) {
  nodes_.clear();
  if (cuboids.empty()) return;
  std::vector<std::uint32_t> order(cuboids.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<Vector3> half(cuboids.size());
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    // A hair wider, so that rounding never hides a point on a face.
    half[i] = reach(cuboids[i]) +
              Vector3::Constant(1e-9 * (1.0 + cuboids[i].center.cwiseAbs().maxCoeff()));
  }
  const auto divide = [&](std::size_t begin, std::size_t middle, std::size_t end) {
    Vector3 low = Vector3::Constant(INFINITY), high = -low;
    for (std::size_t i = begin; i < end; ++i) {
      low = low.cwiseMin(cuboids[order[i]].center);
      high = high.cwiseMax(cuboids[order[i]].center);
    }
    Vector3::Index axis = 0;
    (high - low).maxCoeff(&axis);
    const auto at = [&](std::size_t i) { return order.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
      const double ca = cuboids[a].center[axis];
      const double cb = cuboids[b].center[axis];
      return ca != cb ? ca < cb : a < b;
    });
  };
  struct Range {
    std::size_t node, begin, end;
  };
  std::vector<Range> open{{0, 0, cuboids.size()}};
  nodes_.reserve(cuboids.size() / 3 + 1);
  nodes_.emplace_back();
  while (!open.empty()) {
    const Range range = open.back();
    open.pop_back();
    // All children but the last hold as many cuboids as their levels can.
    std::size_t part = 1;
    while (kChildren * part < range.end - range.begin) part *= kChildren;
    if (range.begin + 2 * part < range.end) divide(range.begin, range.begin + 2 * part, range.end);
    for (std::size_t begin = range.begin; begin < range.end; begin += 2 * part) {
      const std::size_t end = std::min(begin + 2 * part, range.end);
      if (begin + part < end) divide(begin, begin + part, end);
    }
    for (int c = 0; c < kChildren; ++c) {
      const std::size_t begin =
          std::min(range.begin + static_cast<std::size_t>(c) * part, range.end);
      const std::size_t end = std::min(begin + part, range.end);
      Vector3 low = Vector3::Constant(INFINITY), high = -low;
      for (std::size_t i = begin; i < end; ++i) {
        low = low.cwiseMin(cuboids[order[i]].center - half[order[i]]);
        high = high.cwiseMax(cuboids[order[i]].center + half[order[i]]);
      }
      std::uint32_t child = kIsCuboid;
      if (end - begin == 1) {
        child |= order[begin];
      } else if (end > begin) {
        child = static_cast<std::uint32_t>(nodes_.size());
        open.push_back({nodes_.size(), begin, end});
        nodes_.emplace_back();
      }
      Node& node = nodes_[range.node];
      node.child[c] = child;
      for (int i = 0; i < 3; ++i) {
        node.low[i][c] = roundedDown(low[i]);
        node.high[i][c] = roundedUp(high[i]);
      }
    }
  }
  nodes_.shrink_to_fit();
}

}  // namespace planar_mapping::detail
