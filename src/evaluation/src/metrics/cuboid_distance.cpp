// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/cuboid_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace evaluation {
namespace {

constexpr std::uint32_t kLeafBoxes = 4;
constexpr int kBins = 12;
constexpr int kDeepestUneven = 32;  ///< below it boxes are halved by rank: 2^32 of them are no more
constexpr int kDeepest = kDeepestUneven + 34;  ///< nodes that may wait to be visited

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

struct CuboidDistance::Bounds {
  double low[3] = {kInfinity, kInfinity, kInfinity};
  double high[3] = {-kInfinity, -kInfinity, -kInfinity};

  void add(const Bounds& other) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], other.low[k]);
      high[k] = std::max(high[k], other.high[k]);
    }
  }
  double twiceCenter(int axis) const { return low[axis] + high[axis]; }
  double halfSurface() const {
    const double x = high[0] - low[0];
    const double y = high[1] - low[1];
    const double z = high[2] - low[2];
    return x < 0.0 ? 0.0 : x * y + y * z + z * x;
  }
};

CuboidDistance::CuboidDistance(const std::vector<Cuboid>& cuboids) {
  if (cuboids.empty()) return;
  std::vector<Box> boxes;
  std::vector<Bounds> bounds(cuboids.size());
  boxes.reserve(cuboids.size());
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    const Cuboid& cuboid = cuboids[i];
    if (!cuboid.center.allFinite() || !cuboid.size.allFinite() ||
        !cuboid.orientation.coeffs().allFinite() || cuboid.size.minCoeff() < 0.0)
      throw InputError("cuboid " + std::to_string(i) + " has no finite place and size");
    const Matrix3 to_local = cuboid.orientation.toRotationMatrix().transpose();
    const Vector3 half = 0.5 * cuboid.size;
    const Vector3 reach = to_local.transpose().cwiseAbs() * half;
    Box box;
    for (int r = 0; r < 3; ++r) {
      box.center[r] = cuboid.center[r];
      box.half[r] = half[r];
      for (int c = 0; c < 3; ++c) box.to_local[3 * r + c] = to_local(r, c);
      bounds[i].low[r] = cuboid.center[r] - reach[r];
      bounds[i].high[r] = cuboid.center[r] + reach[r];
    }
    box.number = static_cast<std::uint32_t>(i);
    boxes.push_back(box);
  }
  std::vector<std::uint32_t> order(cuboids.size());
  std::iota(order.begin(), order.end(), 0u);
  nodes_.reserve(cuboids.size());
  build(0, static_cast<std::uint32_t>(order.size()), bounds, order, 0);
  boxes_.reserve(boxes.size());
  for (const std::uint32_t i : order) boxes_.push_back(boxes[i]);
}

std::uint32_t CuboidDistance::build(std::uint32_t begin, std::uint32_t end,
                                    const std::vector<Bounds>& bounds,
                                    std::vector<std::uint32_t>& order, int depth) {
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  Bounds all;
  Node node;
  node.least = std::numeric_limits<std::uint32_t>::max();
  for (std::uint32_t i = begin; i < end; ++i) {
    all.add(bounds[order[i]]);
    node.least = std::min(node.least, order[i]);
  }
  std::copy(all.low, all.low + 3, node.low);
  std::copy(all.high, all.high + 3, node.high);
  node.first = begin;
  node.count = end - begin;
  nodes_.push_back(node);
  if (end - begin <= kLeafBoxes) return number;
  const std::uint32_t middle = split(begin, end, bounds, order, depth);
  build(begin, middle, bounds, order, depth + 1);
  const std::uint32_t right = build(middle, end, bounds, order, depth + 1);
  nodes_[number].first = right;
  nodes_[number].count = 0;
  return number;
}

/// Where both sides together have the least surface, each weighed by its boxes: long walls and
/// small things end up on different sides.
std::uint32_t CuboidDistance::split(std::uint32_t begin, std::uint32_t end,
                                    const std::vector<Bounds>& bounds,
                                    std::vector<std::uint32_t>& order, int depth) {
  const auto first = order.begin() + begin;
  const auto last = order.begin() + end;
  double low[3] = {kInfinity, kInfinity, kInfinity};
  double high[3] = {-kInfinity, -kInfinity, -kInfinity};
  for (auto i = first; i != last; ++i) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], bounds[*i].twiceCenter(k));
      high[k] = std::max(high[k], bounds[*i].twiceCenter(k));
    }
  }
  int best_axis = -1;
  int best_bin = 0;
  double least = kInfinity;
  const auto binOf = [&](std::uint32_t box, int axis) {
    const double share = (bounds[box].twiceCenter(axis) - low[axis]) / (high[axis] - low[axis]);
    return std::min(static_cast<int>(share * kBins), kBins - 1);
  };
  for (int axis = 0; axis < 3 && depth < kDeepestUneven; ++axis) {
    if (!(high[axis] > low[axis])) continue;
    Bounds bins[kBins];
    double count[kBins] = {};
    for (auto i = first; i != last; ++i) {
      const int bin = binOf(*i, axis);
      bins[bin].add(bounds[*i]);
      count[bin] += 1.0;
    }
    double right_cost[kBins] = {};
    Bounds right;
    double right_count = 0.0;
    for (int bin = kBins - 1; bin > 0; --bin) {
      right.add(bins[bin]);
      right_count += count[bin];
      right_cost[bin] = right_count * right.halfSurface();
    }
    Bounds left;
    double left_count = 0.0;
    for (int bin = 1; bin < kBins; ++bin) {
      left.add(bins[bin - 1]);
      left_count += count[bin - 1];
      const double cost = left_count * left.halfSurface() + right_cost[bin];
      if (cost >= least) continue;
      least = cost;
      best_axis = axis;
      best_bin = bin;
    }
  }
  if (best_axis >= 0) {
    const auto middle = std::partition(
        first, last, [&](std::uint32_t box) { return binOf(box, best_axis) < best_bin; });
    if (middle != first && middle != last)
      return static_cast<std::uint32_t>(middle - order.begin());
  }
  int axis = 0;
  for (const int k : {1, 2})
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  const auto middle = first + (last - first) / 2;
  std::nth_element(first, middle, last, [&](std::uint32_t l, std::uint32_t r) {
    const double a = bounds[l].twiceCenter(axis);
    const double b = bounds[r].twiceCenter(axis);
    return a != b ? a < b : l < r;
  });
  return static_cast<std::uint32_t>(middle - order.begin());
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
  std::uint32_t stack[kDeepest];
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const std::uint32_t number = stack[--size];
    const Node& node = nodes_[number];
    if (!(squaredDistance(node, point.data()) <= squared)) continue;
    if (node.count == 0) {
      stack[size++] = node.first;
      stack[size++] = number + 1;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      if (!(squaredDistance(boxes_[i], point.data()) <= squared)) continue;
      hint = i;
      return true;
    }
  }
  return false;
}

void CuboidDistance::findBefore(std::size_t end, const Vector3& center, const Matrix3& half_axes,
                                Overlap& overlap) const {
  overlap.is_whole = false;
  overlap.cuboids.clear();
  if (nodes_.empty()) return;
  const Vector3 reach = half_axes.cwiseAbs().rowwise().sum();
  std::uint32_t stack[kDeepest];
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const std::uint32_t number = stack[--size];
    const Node& node = nodes_[number];
    bool meets = node.least < end;
    for (int k = 0; k < 3; ++k)
      meets = meets && center[k] + reach[k] >= node.low[k] && center[k] - reach[k] <= node.high[k];
    if (!meets) continue;
    if (node.count == 0) {
      stack[size++] = node.first;
      stack[size++] = number + 1;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Box& box = boxes_[i];
      if (box.number >= end) continue;
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
      if (is_apart) continue;
      overlap.cuboids.push_back(i);
      overlap.is_whole = is_whole;
      if (is_whole) return;
    }
  }
}

}  // namespace evaluation
}  // namespace planar_mapping
