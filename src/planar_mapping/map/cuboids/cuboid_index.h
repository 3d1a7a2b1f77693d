// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/oriented_box.h"
#include "planar_mapping/map/store/key_map.h"

namespace planar_mapping::detail {

/// Bounding volume hierarchy over cuboids: huge cuboids and far coordinates cost nothing extra.
class PLANAR_MAPPING_EXPORT CuboidIndex {
 public:
  void build(const std::vector<Cuboid>& cuboids);
  /// Calls visit(index) for every cuboid whose axis-aligned bounds, grown by margin, contain the
  /// point, and maybe others, until visit returns false. In no particular order.
  template <typename Visit>
  void visit(const Vector3& point, double margin, Visit&& visit) const {
    const Vector3 reach = Vector3::Constant(margin);
    visitBox(point - reach, point + reach, visit);
  }
  /// Calls visit(index) for every cuboid whose axis-aligned bounds meet the box, and maybe others,
  /// until visit returns false. In no particular order.
  template <typename Visit>
  void visitBox(const Vector3& low, const Vector3& high, Visit&& visit) const {
    if (nodes_.empty()) return;
    const Node* nodes = nodes_.data();
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
          if (!visit(order_[i])) return;
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
  void visitAlong(const Vector3& origin, const Vector3& direction, const double& range,
                  Visit&& visit) const {
    visitByBound([&](const Node& node) { return entryOf(node, origin, direction); }, range, visit);
  }
  /// Calls visit(index) for the cuboids whose axis-aligned bounds are within a squared distance of
  /// the point, which visit may shorten on the way, and maybe others; of two groups the nearer one
  /// comes first.
  template <typename Visit>
  void visitNearest(const Vector3& point, const double& squared_range, Visit&& visit) const {
    visitByBound([&](const Node& node) { return squaredDistance(node, point); }, squared_range,
                 visit);
  }
  std::size_t memoryBytes() const {  ///< on the heap
    return capacityBytes(nodes_) + capacityBytes(order_);
  }

 private:
  static constexpr int kMaxDepth = 64;  // halves each time, and 2^32 cuboids do not fit
  struct Node {
    float low[3];  ///< rounded outwards
    float high[3];
    std::uint32_t first = 0;  ///< of the order in a leaf, else the two children
    std::uint32_t count = 0;  ///< 0 = inner node
  };
  /// Visits the groups whose bound is within the limit, of two the one with the lower bound first.
  template <typename Bound, typename Visit>
  void visitByBound(const Bound& bound, const double& limit, Visit& visit) const {
    if (nodes_.empty()) return;
    const Node* nodes = nodes_.data();
    struct Open {
      std::uint32_t node;
      double bound;
    };
    Open stack[kMaxDepth];
    int top = 0;
    stack[top++] = {0, bound(nodes[0])};
    while (top > 0) {
      const Open open = stack[--top];
      if (!(open.bound <= limit)) continue;
      const Node& node = nodes[open.node];
      if (node.count > 0) {
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) visit(order_[i]);
        continue;
      }
      Open near = {node.first, bound(nodes[node.first])};
      Open far = {node.first + 1, bound(nodes[node.first + 1])};
      if (far.bound < near.bound) std::swap(near, far);
      stack[top++] = far;
      stack[top++] = near;
    }
  }
  /// Where the ray enters the bounds of a node, at least 0; infinite if it does not.
  static double entryOf(const Node& node, const Vector3& origin, const Vector3& direction) {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    double from = 0.0;
    double to = kNever;
    const Vector3 low = Eigen::Map<const Eigen::Vector3f>(node.low).cast<double>();
    const Vector3 high = Eigen::Map<const Eigen::Vector3f>(node.high).cast<double>();
    return clipToBox(low, high, origin, direction, from, to) ? from : kNever;
  }

  static double squaredDistance(const Node& node, const Vector3& point) {
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double outside = std::max({node.low[i] - point[i], point[i] - node.high[i], 0.0});
      sum += outside * outside;
    }
    return sum;
  }

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;  ///< of the cuboids, by leaves
};

}  // namespace planar_mapping::detail
