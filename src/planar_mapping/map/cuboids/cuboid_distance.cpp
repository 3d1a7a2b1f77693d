// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/cuboids/cuboid_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "planar_mapping/base/error.h"

namespace planar_mapping {

CuboidDistance::CuboidDistance(const std::vector<Cuboid>& cuboids) {
  boxes_.reserve(cuboids.size());
  for (const Cuboid& cuboid : cuboids) {
    if (!cuboid.center.allFinite() || !cuboid.size.allFinite() ||
        !cuboid.orientation.coeffs().allFinite() || cuboid.size.minCoeff() < 0.0)
      throw InputError("cuboid " + std::to_string(boxes_.size()) + " has no finite place and size");
    const Matrix3 to_local = cuboid.orientation.toRotationMatrix().transpose();
    Box box;
    for (int r = 0; r < 3; ++r) {
      box.center[r] = cuboid.center[r];
      box.half[r] = 0.5 * cuboid.size[r];
      for (int c = 0; c < 3; ++c) box.to_local[3 * r + c] = to_local(r, c);
    }
    boxes_.push_back(box);
  }
  index_.build(cuboids);
}

double CuboidDistance::squaredDistance(const Box& box, const Vector3& point) {
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

double CuboidDistance::distance(const Vector3& point) const {
  std::uint32_t hint = 0;
  return distance(point, hint);
}

bool CuboidDistance::isWithin(const Vector3& point, double margin) const {
  std::uint32_t hint = 0;
  return isWithin(point, margin, hint);
}

double CuboidDistance::distance(const Vector3& point, std::uint32_t& hint) const {
  if (boxes_.empty()) return std::numeric_limits<double>::infinity();
  if (hint >= boxes_.size()) hint = 0;
  double nearest = squaredDistance(boxes_[hint], point);
  double range = nearest > 0.0 ? nearest : -1.0;  // nothing is nearer than what holds the point
  index_.visitNearest(point, range, [&](std::uint32_t i) {
    const double squared = squaredDistance(boxes_[i], point);
    if (squared >= nearest) return;
    nearest = squared;
    range = nearest > 0.0 ? nearest : -1.0;
    hint = i;
  });
  return std::sqrt(nearest);
}

bool CuboidDistance::isWithin(const Vector3& point, double margin, std::uint32_t& hint) const {
  if (boxes_.empty() || !(margin >= 0.0)) return false;
  const double squared = margin * margin;
  if (hint >= boxes_.size()) hint = 0;
  if (squaredDistance(boxes_[hint], point) <= squared) return true;
  bool found = false;
  index_.visit(point, margin, [&](std::uint32_t i) {
    found = squaredDistance(boxes_[i], point) <= squared;
    if (found) hint = i;
    return !found;
  });
  return found;
}

void CuboidDistance::findBefore(std::size_t end, const Vector3& center, const Matrix3& half_axes,
                                Overlap& overlap) const {
  overlap.is_whole = false;
  overlap.cuboids.clear();
  const Vector3 reach = half_axes.cwiseAbs().rowwise().sum();
  index_.visitBox(center - reach, center + reach, [&](std::uint32_t i) {
    if (i >= end) return true;
    const Box& box = boxes_[i];
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

}  // namespace planar_mapping
