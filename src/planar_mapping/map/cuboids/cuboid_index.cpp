// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/cuboids/cuboid_index.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace planar_mapping::detail {
namespace {

constexpr std::uint32_t kLeafSize = 4;

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
  order_.resize(cuboids.size());
  std::iota(order_.begin(), order_.end(), 0u);
  if (cuboids.empty()) return;
  std::vector<Vector3> half(cuboids.size());
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    // A hair wider, so that rounding never hides a point on a face.
    half[i] = reach(cuboids[i]) +
              Vector3::Constant(1e-9 * (1.0 + cuboids[i].center.cwiseAbs().maxCoeff()));
  }
  struct Range {
    std::uint32_t node, begin, end;
  };
  nodes_.reserve(cuboids.size());
  nodes_.emplace_back();
  std::vector<Range> open{{0, 0, static_cast<std::uint32_t>(cuboids.size())}};
  while (!open.empty()) {
    const Range range = open.back();
    open.pop_back();
    Vector3 low = Vector3::Constant(INFINITY), high = -low, centre_low = low, centre_high = high;
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      const std::uint32_t c = order_[i];
      low = low.cwiseMin(cuboids[c].center - half[c]);
      high = high.cwiseMax(cuboids[c].center + half[c]);
      centre_low = centre_low.cwiseMin(cuboids[c].center);
      centre_high = centre_high.cwiseMax(cuboids[c].center);
    }
    for (int i = 0; i < 3; ++i) {
      nodes_[range.node].low[i] = roundedDown(low[i]);
      nodes_[range.node].high[i] = roundedUp(high[i]);
    }
    if (range.end - range.begin <= kLeafSize) {
      nodes_[range.node].first = range.begin;
      nodes_[range.node].count = range.end - range.begin;
      continue;
    }
    Vector3::Index axis = 0;
    (centre_high - centre_low).maxCoeff(&axis);
    const std::uint32_t middle = range.begin + (range.end - range.begin) / 2;
    std::nth_element(order_.begin() + range.begin, order_.begin() + middle,
                     order_.begin() + range.end, [&](std::uint32_t a, std::uint32_t b) {
                       const double ca = cuboids[a].center[axis];
                       const double cb = cuboids[b].center[axis];
                       return ca != cb ? ca < cb : a < b;
                     });
    const auto child = static_cast<std::uint32_t>(nodes_.size());
    nodes_[range.node].first = child;
    nodes_.emplace_back();
    nodes_.emplace_back();
    open.push_back({child, range.begin, middle});
    open.push_back({child + 1, middle, range.end});
  }
  nodes_.shrink_to_fit();
}

}  // namespace planar_mapping::detail
