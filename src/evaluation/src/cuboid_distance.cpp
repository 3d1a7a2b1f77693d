// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/cuboid_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "planar_mapping/core/error.h"

namespace planar_mapping {
namespace evaluation {
namespace {

constexpr std::uint32_t kLeafBoxes = 4;
constexpr int kDeepest = 64;  ///< halving by rank: 2^60 cuboids would not get there

}  // namespace

CuboidDistance::CuboidDistance(const std::vector<Cuboid>& cuboids) {
  if (cuboids.empty()) return;
  std::vector<Box> boxes;
  std::vector<double> bounds;  // low and high of each
  boxes.reserve(cuboids.size());
  bounds.reserve(6 * cuboids.size());
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
    }
    box.number = static_cast<std::uint32_t>(i);
    boxes.push_back(box);
    for (int k = 0; k < 3; ++k) bounds.push_back(cuboid.center[k] - reach[k]);
    for (int k = 0; k < 3; ++k) bounds.push_back(cuboid.center[k] + reach[k]);
  }
  std::vector<std::uint32_t> order(cuboids.size());
  std::iota(order.begin(), order.end(), 0u);
  nodes_.reserve(cuboids.size());
  boxes_ = boxes;
  build(0, static_cast<std::uint32_t>(order.size()), bounds, order);
  for (std::size_t i = 0; i < order.size(); ++i) boxes_[i] = boxes[order[i]];
}

std::uint32_t CuboidDistance::build(std::uint32_t begin, std::uint32_t end,
                                    const std::vector<double>& bounds,
                                    std::vector<std::uint32_t>& order) {
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  Node node;
  for (int k = 0; k < 3; ++k) {
    node.low[k] = std::numeric_limits<double>::infinity();
    node.high[k] = -node.low[k];
  }
  node.least = std::numeric_limits<std::uint32_t>::max();
  for (std::uint32_t i = begin; i < end; ++i) {
    const double* b = bounds.data() + std::size_t{6} * order[i];
    for (int k = 0; k < 3; ++k) {
      node.low[k] = std::min(node.low[k], b[k]);
      node.high[k] = std::max(node.high[k], b[k + 3]);
    }
    node.least = std::min(node.least, order[i]);
  }
  node.first = begin;
  node.count = end - begin;
  nodes_.push_back(node);
  if (end - begin <= kLeafBoxes) return number;
  int axis = 0;
  for (const int k : {1, 2})
    if (node.high[k] - node.low[k] > node.high[axis] - node.low[axis]) axis = k;
  const std::uint32_t middle = begin + (end - begin) / 2;
  const auto from = order.begin();
  std::nth_element(from + begin, from + middle, from + end, [&](std::uint32_t l, std::uint32_t r) {
    const auto twiceCenter = [&](std::uint32_t i) {
      const double* b = bounds.data() + std::size_t{6} * i;
      return b[axis] + b[axis + 3];
    };
    const double a = twiceCenter(l);
    const double b = twiceCenter(r);
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

double CuboidDistance::distance(const Vector3& point) const {
  double nearest = std::numeric_limits<double>::infinity();
  if (nodes_.empty()) return nearest;
  struct Entry {
    std::uint32_t node;
    double squared;
  };
  Entry stack[kDeepest];
  int size = 0;
  stack[size++] = {0, squaredDistance(nodes_[0], point.data())};
  while (size > 0) {
    const Entry entry = stack[--size];
    if (entry.squared >= nearest) continue;
    const Node& node = nodes_[entry.node];
    if (node.count > 0) {
      for (std::uint32_t i = 0; i < node.count; ++i)
        nearest = std::min(nearest, squaredDistance(boxes_[node.first + i], point.data()));
      continue;
    }
    Entry left{entry.node + 1, squaredDistance(nodes_[entry.node + 1], point.data())};
    Entry right{node.first, squaredDistance(nodes_[node.first], point.data())};
    if (left.squared < right.squared) std::swap(left, right);
    stack[size++] = left;
    stack[size++] = right;
  }
  return std::sqrt(nearest);
}

bool CuboidDistance::isWithin(const Vector3& point, double margin) const {
  if (nodes_.empty() || !(margin >= 0.0)) return false;
  const double squared = margin * margin;
  std::uint32_t stack[kDeepest];
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const std::uint32_t number = stack[--size];
    const Node& node = nodes_[number];
    if (squaredDistance(node, point.data()) > squared) continue;
    if (node.count == 0) {
      stack[size++] = node.first;
      stack[size++] = number + 1;
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; ++i)
      if (squaredDistance(boxes_[node.first + i], point.data()) <= squared) return true;
  }
  return false;
}

bool CuboidDistance::isInsideOneBefore(const Vector3& point, std::size_t end) const {
  if (nodes_.empty()) return false;
  std::uint32_t stack[kDeepest];
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const std::uint32_t number = stack[--size];
    const Node& node = nodes_[number];
    if (node.least >= end || squaredDistance(node, point.data()) > 0.0) continue;
    if (node.count == 0) {
      stack[size++] = node.first;
      stack[size++] = number + 1;
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; ++i) {
      const Box& box = boxes_[node.first + i];
      if (box.number < end && squaredDistance(box, point.data()) <= 0.0) return true;
    }
  }
  return false;
}

}  // namespace evaluation
}  // namespace planar_mapping
