// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/oriented_box.h"
#include "planar_mapping/map/store/key_map.h"

namespace planar_mapping::detail {

/// Bounding volume hierarchy over cuboids: huge cuboids and far coordinates cost nothing extra. A
/// node holds the bounds of four children side by side, which are compared at once.
class PLANAR_MAPPING_EXPORT CuboidIndex {
 public:
  void build(const std::vector<Cuboid>& cuboids);
  /// Calls visit(index) for every cuboid that contains the point when it is grown by margin along
  /// its own axes, and maybe others, until visit returns false. In no particular order.
  template <typename Visit>
  void visit(const Vector3& point, double margin, Visit&& visit) const {
    // The axis-aligned bounds of a turned cuboid grow by the diagonal of the margin at most.
    const Vector3 reach = Vector3::Constant(std::sqrt(3.0) * margin);
    visitBox(point - reach, point + reach, visit);
  }
  /// Calls visit(index) for every cuboid whose axis-aligned bounds meet the box, and maybe others,
  /// until visit returns false. In no particular order.
  template <typename Visit>
  void visitBox(const Vector3& low, const Vector3& high, Visit&& visit) const {
    if (nodes_.empty()) return;
    // Bounds are floats: rounding to nearest keeps the order between them and the box.
    const Eigen::Vector3f from = low.cast<float>();
    const Eigen::Vector3f to = high.cast<float>();
    std::uint32_t stack[kMaxOpen];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const Node& node = nodes_[stack[--top]];
      std::int32_t meets[kChildren];
      for (int c = 0; c < kChildren; ++c) {
        meets[c] = static_cast<int>(to[0] >= node.low[0][c]) & (from[0] <= node.high[0][c]) &
                   (to[1] >= node.low[1][c]) & (from[1] <= node.high[1][c]) &
                   (to[2] >= node.low[2][c]) & (from[2] <= node.high[2][c]);
      }
      for (int c = 0; c < kChildren; ++c) {
        if (meets[c] == 0) continue;
        if ((node.child[c] & kIsCuboid) == 0) {
          stack[top++] = node.child[c];
        } else if (!visit(node.child[c] & ~kIsCuboid)) {
          return;
        }
      }
    }
  }
  /// Calls visit(index) for the cuboids whose axis-aligned bounds the ray enters within range,
  /// which visit may shorten on the way, and maybe others; of two the one whose bounds the ray
  /// enters first comes first. \param direction finite, not 0
  template <typename Visit>
  void visitAlong(const Vector3& origin, const Vector3& direction, const double& range,
                  Visit&& visit) const {
    const auto entry = [&](const Vector3& low, const Vector3& high) {
      constexpr double kNever = std::numeric_limits<double>::infinity();
      double from = 0.0;
      double to = kNever;
      return clipToBox(low, high, origin, direction, from, to) ? from : kNever;
    };
    visitByBound(entry, range, visit);
  }
  /// Calls visit(index) for the cuboids whose axis-aligned bounds are within a squared distance of
  /// the point, which visit may shorten on the way, and maybe others; of two the one with nearer
  /// bounds comes first.
  template <typename Visit>
  void visitNearest(const Vector3& point, const double& squared_range, Visit&& visit) const {
    const auto squaredDistance = [&](const Vector3& low, const Vector3& high) {
      return (low - point).cwiseMax(point - high).cwiseMax(0.0).squaredNorm();
    };
    visitByBound(squaredDistance, squared_range, visit);
  }
  std::size_t memoryBytes() const { return capacityBytes(nodes_); }  ///< on the heap

 private:
  static constexpr int kChildren = 4;
  /// Each of at most 16 levels (4^16 cuboids) leaves three children open.
  static constexpr int kMaxOpen = 3 * 16 + 1;
  static constexpr std::uint32_t kIsCuboid = 0x80000000u;
  struct Node {
    float low[3][kChildren];  ///< rounded outwards; of a child that is missing above the high ones
    float high[3][kChildren];
    std::uint32_t child[kChildren];  ///< a node, or a cuboid's number with kIsCuboid
  };
  /// Visits cuboids whose bound is within the limit, the lowest one first.
  template <typename Bound, typename Visit>
  void visitByBound(const Bound& bound, const double& limit, Visit& visit) const {
    if (nodes_.empty()) return;
    struct Open {
      std::uint32_t child;
      double bound;
    };
    Open stack[kMaxOpen];
    int top = 0;
    stack[top++] = {0, 0.0};
    while (top > 0) {
      const Open open = stack[--top];
      if (!(open.bound <= limit)) continue;
      if ((open.child & kIsCuboid) != 0) {
        visit(open.child & ~kIsCuboid);
        continue;
      }
      const Node& node = nodes_[open.child];
      const int first = top;
      for (int c = 0; c < kChildren; ++c) {
        if (node.low[0][c] > node.high[0][c]) break;  // no more children
        const double its = bound(Vector3(node.low[0][c], node.low[1][c], node.low[2][c]),
                                 Vector3(node.high[0][c], node.high[1][c], node.high[2][c]));
        if (!(its <= limit)) continue;
        int at = top++;
        for (; at > first && stack[at - 1].bound < its; --at) stack[at] = stack[at - 1];
        stack[at] = {node.child[c], its};
      }
    }
  }

  std::vector<Node> nodes_;  ///< the first one is the root
};

}  // namespace planar_mapping::detail
