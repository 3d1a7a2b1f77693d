// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/cuboid_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::evaluation {
namespace {

constexpr std::uint32_t kLeafBoxes = 4;
constexpr int kDeepest = 34;  ///< nodes that may wait to be visited: boxes are halved, 2^32 at most

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

CuboidDistance::CuboidDistance(const std::vector<Cuboid>& cuboids) {
  if (cuboids.empty()) return;
  std::vector<Eigen::AlignedBox3d> bounds;
  bounds.reserve(cuboids.size());
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    const Cuboid& cuboid = cuboids[i];
    if (!cuboid.center.allFinite() || !cuboid.size.allFinite() ||
        !cuboid.orientation.coeffs().allFinite() || cuboid.size.minCoeff() < 0.0)
      throw InputError("cuboid " + std::to_string(i) + " has no finite place and size");
    const Vector3 half = reach(cuboid);
    bounds.emplace_back(cuboid.center - half, cuboid.center + half);
  }
  std::vector<std::uint32_t> order(cuboids.size());
  std::iota(order.begin(), order.end(), 0u);
  nodes_.reserve(cuboids.size());
  build(0, static_cast<std::uint32_t>(order.size()), bounds, order);
  bounds = std::vector<Eigen::AlignedBox3d>();  // they are as many, and no longer needed
  boxes_.reserve(cuboids.size());
  for (const std::uint32_t i : order) {
    const Matrix3 to_local = cuboids[i].orientation.toRotationMatrix().transpose();
    Box box;
    for (int r = 0; r < 3; ++r) {
      box.center[r] = cuboids[i].center[r];
      box.half[r] = 0.5 * cuboids[i].size[r];
      for (int c = 0; c < 3; ++c) box.to_local[3 * r + c] = to_local(r, c);
    }
    box.number = i;
    boxes_.push_back(box);
  }
}

/// Halves the boxes along the axis in which their centres lie farthest apart.
std::uint32_t CuboidDistance::build(std::uint32_t begin, std::uint32_t end,
                                    const std::vector<Eigen::AlignedBox3d>& bounds,
                                    std::vector<std::uint32_t>& order) {
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  Eigen::AlignedBox3d all;
  Eigen::AlignedBox3d centers;
  Node node;
  node.least = std::numeric_limits<std::uint32_t>::max();
  for (std::uint32_t i = begin; i < end; ++i) {
    all.extend(bounds[order[i]]);
    centers.extend(bounds[order[i]].center());
    node.least = std::min(node.least, order[i]);
  }
  Eigen::Map<Vector3>(node.low) = all.min();
  Eigen::Map<Vector3>(node.high) = all.max();
  node.first = begin;
  node.count = end - begin;
  nodes_.push_back(node);
  if (end - begin <= kLeafBoxes) return number;
  Eigen::Index axis = 0;
  centers.sizes().maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                   [&](std::uint32_t l, std::uint32_t r) {
                     const double a = bounds[l].center()[axis];
                     const double b = bounds[r].center()[axis];
                     return a != b ? a < b : l < r;
                   });
  build(begin, middle, bounds, order);
  const std::uint32_t right = build(middle, end, bounds, order);
  nodes_[number].first = right;
  nodes_[number].count = 0;
  return number;
}

double CuboidDistance::squaredDistance(const Box& box, const double* point) {
  const double d[3] = {point[0] - box.center[0], point[1] - box.center[1],
                       point[2] - box.center[2]};
  double sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double* row = box.to_local + 3 * k;
    const double outside =
        std::max(std::abs(row[0] * d[0] + row[1] * d[1] + row[2] * d[2]) - box.half[k], 0.0);
    sum += outside * outside;
  }
  return sum;
}

double CuboidDistance::squaredDistance(const Node& node, const double* point) {
  double sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double outside = std::max(std::max(node.low[k] - point[k], point[k] - node.high[k]), 0.0);
    sum += outside * outside;
  }
  return sum;
}

template <typename Meets, typename Visit>
void CuboidDistance::forEachBox(const Meets& meets, const Visit& visit) const {
  std::uint32_t stack[kDeepest];
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const std::uint32_t number = stack[--size];
    const Node& node = nodes_[number];
    if (!meets(node)) continue;
    if (node.count == 0) {
      stack[size++] = node.first;
      stack[size++] = number + 1;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
      if (!visit(i)) return;
  }
}

double CuboidDistance::distance(const Vector3& point) const {
  std::uint32_t hint = 0;
  return distance(point, hint);
}

bool CuboidDistance::isWithin(const Vector3& point, double margin) const {
  std::uint32_t hint = 0;
  return isWithin(point, margin, hint);
}

double CuboidDistance::distance(const Vector3& point, std::uint32_t& hint) const {
  if (nodes_.empty()) return kInfinity;
  struct Entry {
    std::uint32_t node;
    double squared;
  };
  Entry stack[kDeepest];
  int size = 0;
  if (hint >= boxes_.size()) hint = 0;
  double nearest = squaredDistance(boxes_[hint], point.data());
  stack[size++] = {0, squaredDistance(nodes_[0], point.data())};
  while (size > 0) {
    const Entry entry = stack[--size];
    if (entry.squared >= nearest) continue;
    const Node& node = nodes_[entry.node];
    if (node.count > 0) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const double squared = squaredDistance(boxes_[i], point.data());
        if (squared >= nearest) continue;
        nearest = squared;
        hint = i;
      }
      continue;
    }
    Entry left{entry.node + 1, squaredDistance(nodes_[entry.node + 1], point.data())};
    Entry right{node.first, squaredDistance(nodes_[node.first], point.data())};
    if (left.squared < right.squared) std::swap(left, right);
    if (left.squared < nearest) stack[size++] = left;
    if (right.squared < nearest) stack[size++] = right;
  }
  return std::sqrt(nearest);
}

bool CuboidDistance::isWithin(const Vector3& point, double margin, std::uint32_t& hint) const {
  if (nodes_.empty() || !(margin >= 0.0)) return false;
  const double squared = margin * margin;
  if (hint >= boxes_.size()) hint = 0;
  if (squaredDistance(boxes_[hint], point.data()) <= squared) return true;
  bool found = false;
  const auto isNear = [&](const Node& node) {
    return squaredDistance(node, point.data()) <= squared;
  };
  forEachBox(isNear, [&](std::uint32_t i) {
    found = squaredDistance(boxes_[i], point.data()) <= squared;
    if (found) hint = i;
    return !found;
  });
  return found;
}

void CuboidDistance::findBefore(std::size_t end, const Vector3& center, const Matrix3& half_axes,
                                Overlap& overlap) const {
  overlap.is_whole = false;
  overlap.cuboids.clear();
  if (nodes_.empty()) return;
  const Vector3 reach = half_axes.cwiseAbs().rowwise().sum();
  const auto meets = [&](const Node& node) {
    bool overlaps = node.least < end;
    for (int k = 0; k < 3; ++k)
      overlaps =
          overlaps && center[k] + reach[k] >= node.low[k] && center[k] - reach[k] <= node.high[k];
    return overlaps;
  };
  forEachBox(meets, [&](std::uint32_t i) {
    const Box& box = boxes_[i];
    if (box.number >= end) return true;
    // Shadows of the block on the axes of the cuboid.
    bool is_apart = false;
    bool is_whole = true;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Map<const Eigen::RowVector3d> axis(box.to_local + 3 * k);
      const double middle = std::abs(axis * (center - Eigen::Map<const Vector3>(box.center)));
      const double shadow = (axis * half_axes).cwiseAbs().sum();
      is_apart = is_apart || middle - shadow > box.half[k];
      is_whole = is_whole && middle + shadow <= box.half[k];
    }
    if (is_apart) return true;
    overlap.cuboids.push_back(i);
    overlap.is_whole = is_whole;
    return !is_whole;
  });
}

}  // namespace planar_mapping::evaluation
