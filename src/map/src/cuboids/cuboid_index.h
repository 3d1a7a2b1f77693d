// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "store/heap_bytes.h"
#include "store/heap_value.h"
#include "planar_mapping/core/geometry/cuboid.h"

namespace planar_mapping::detail {

/// Bounding volume hierarchy over cuboids: huge cuboids and far coordinates cost nothing extra. Few
/// cuboids need none: each whose bounding sphere is met is visited.
class CuboidIndex {
 public:
  static constexpr std::uint32_t kFew = 12;

  // Of the following the first argument is the list that the index was built of.
  void build(const std::vector<Cuboid>& cuboids);
  /// Calls visit(index) for every cuboid whose axis-aligned bounds, grown by margin, contain the
  /// point, and maybe others, until visit returns false. In no particular order.
  template <typename Visit>
  void visit(const std::vector<Cuboid>& cuboids, const Vector3& point, double margin,
             Visit&& visit) const {
    const Vector3 reach = Vector3::Constant(margin);
    visitBox(cuboids, point - reach, point + reach, visit);
  }
  /// Calls visit(index) for every cuboid whose axis-aligned bounds meet the box, and maybe others,
  /// until visit returns false. In no particular order.
  template <typename Visit>
  void visitBox(const std::vector<Cuboid>& cuboids, const Vector3& low, const Vector3& high,
                Visit&& visit) const {
    if (!tree_) {
      for (std::uint32_t i = 0; i < cuboids.size(); ++i) {
        const Vector3& center = cuboids[i].center;
        const Vector3 gap = (low - center).cwiseMax(center - high).cwiseMax(0.0);
        if (gap.squaredNorm() <= squaredRadius(cuboids[i]) && !visit(i)) return;
      }
      return;
    }
    const Node* nodes = tree_->nodes.data();
    std::uint32_t stack[kMaxDepth];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const Node& node = nodes[stack[--top]];
      bool meets = true;
      for (int i = 0; i < 3; ++i) meets &= high[i] >= node.low[i] && low[i] <= node.high[i];
      if (!meets) continue;
      if (node.count > 0) {
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
          if (!visit(tree_->order[i])) return;
        }
        continue;
      }
      stack[top++] = node.first + 1;
      stack[top++] = node.first;
    }
  }
  /// Calls visit(index) for the cuboids whose axis-aligned bounds the ray enters within range,
  /// which visit may shorten on the way, and maybe others; of two groups the one that the ray
  /// enters first comes first. \param direction finite, not 0
  template <typename Visit>
  void visitAlong(const std::vector<Cuboid>& cuboids, const Vector3& origin,
                  const Vector3& direction, const double& range, Visit&& visit) const {
    if (!tree_) {
      const double squared_length = direction.squaredNorm();
      for (std::uint32_t i = 0; i < cuboids.size(); ++i) {
        const Vector3 to = cuboids[i].center - origin;
        const double nearest = std::clamp(to.dot(direction) / squared_length, 0.0, range);
        const Vector3 gap = to - nearest * direction;
        if (gap.squaredNorm() <= squaredRadius(cuboids[i])) visit(i);
      }
      return;
    }
    const Node* nodes = tree_->nodes.data();
    struct Open {
      std::uint32_t node;
      double entry;
    };
    Open stack[kMaxDepth];
    int top = 0;
    stack[top++] = {0, entryOf(nodes[0], origin, direction)};
    while (top > 0) {
      const Open open = stack[--top];
      if (!(open.entry <= range)) continue;
      const Node& node = nodes[open.node];
      if (node.count > 0) {
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) visit(tree_->order[i]);
        continue;
      }
      Open near = {node.first, entryOf(nodes[node.first], origin, direction)};
      Open far = {node.first + 1, entryOf(nodes[node.first + 1], origin, direction)};
      if (far.entry < near.entry) std::swap(near, far);
      stack[top++] = far;
      stack[top++] = near;
    }
  }
  std::size_t memoryBytes() const {  ///< on the heap
    return tree_ ? heapBytes(sizeof(Tree)) + heapBytes(tree_->nodes) + heapBytes(tree_->order) : 0;
  }

 private:
  static constexpr int kMaxDepth = 64;  // halves each time, and 2^32 cuboids do not fit
  struct Node {
    float low[3];  ///< rounded outwards
    float high[3];
    std::uint32_t first = 0;  ///< of the order in a leaf, else the two children
    std::uint32_t count = 0;  ///< 0 = inner node
  };
  /// Of the bounding sphere, a hair wider, so that rounding never hides a corner.
  static double squaredRadius(const Cuboid& cuboid) {
    return (1.0 + 1e-6) * 0.25 * cuboid.size.squaredNorm();
  }
  /// Where the ray enters the bounds of a node, at least 0; infinite if it does not.
  static double entryOf(const Node& node, const Vector3& origin, const Vector3& direction) {
    double from = 0.0;
    double to = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      const double low = node.low[i] - origin[i];
      const double high = node.high[i] - origin[i];
      if (direction[i] == 0.0) {
        if (low > 0.0 || high < 0.0) return std::numeric_limits<double>::infinity();
        continue;
      }
      const double a = low / direction[i];
      const double b = high / direction[i];
      from = std::max(from, std::min(a, b));
      to = std::min(to, std::max(a, b));
    }
    return from <= to ? from : std::numeric_limits<double>::infinity();
  }

  struct Tree {
    std::vector<Node> nodes;
    std::vector<std::uint32_t> order;  ///< of the cuboids, by leaves
  };
  static Tree treeOf(const std::vector<Cuboid>& cuboids);

  HeapValue<Tree> tree_;  ///< of more than kFew cuboids
};

}  // namespace planar_mapping::detail
