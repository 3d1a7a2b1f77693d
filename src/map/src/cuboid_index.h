// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "heap_bytes.h"
#include "planar_mapping/core/cuboid.h"

namespace planar_mapping::detail {

/// Bounding volume hierarchy over cuboids: huge cuboids and far coordinates cost nothing extra.
class CuboidIndex {
 public:
  void build(const std::vector<Cuboid>& cuboids);
  /// Calls visit(index) for every cuboid whose axis-aligned bounds, grown by margin, contain the
  /// point, until visit returns false. In no particular order.
  template <typename Visit>
  void visit(const Vector3& point, double margin, Visit&& visit) const {
    if (nodes_.empty()) return;
    std::uint32_t stack[kMaxDepth];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const Node& node = nodes_[stack[--top]];
      bool inside = true;
      for (int i = 0; i < 3; ++i) {
        inside &= point[i] >= node.low[i] - margin && point[i] <= node.high[i] + margin;
      }
      if (!inside) continue;
      if (node.count > 0) {
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
          if (!visit(order_[i])) return;
        }
        continue;
      }
      stack[top++] = node.first + 1;
      stack[top++] = node.first;
    }
  }
  std::size_t memoryBytes() const { return heapBytes(nodes_) + heapBytes(order_); }

 private:
  static constexpr int kMaxDepth = 64;  // halves each time, and 2^32 cuboids do not fit
  struct Node {
    float low[3];  ///< rounded outwards
    float high[3];
    std::uint32_t first = 0;  ///< of order_ in a leaf, else the two children
    std::uint32_t count = 0;  ///< 0 = inner node
  };
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
};

}  // namespace planar_mapping::detail
