// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/half_cell_box.h"

#include <cmath>
#include <cstring>

namespace planar_mapping::detail {
namespace {

bool isSame(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

/// The orientation by the axes of the world that u, v and n are.
unsigned axesOf(const Quaternion& orientation) {
  if (orientation.coeffs() == Quaternion::Identity().coeffs()) return 0;
  const Matrix3 turned = orientation.toRotationMatrix();
  unsigned axes = 0;
  for (int column = 0; column < 3; ++column) {
    int row = 0;
    turned.col(column).cwiseAbs().maxCoeff(&row);
    axes |= (static_cast<unsigned>(row + 1) | (turned(row, column) < 0.0 ? 4u : 0u))
            << (3 * column);
  }
  return axes;
}

}  // namespace

Quaternion HalfCellBox::orientation() const {
  if (axes == 0) return Quaternion::Identity();
  Matrix3 turned = Matrix3::Zero();
  for (int column = 0; column < 3; ++column) {
    const unsigned axis = axes >> (3 * column) & 7u;
    turned(static_cast<int>((axis & 3u) - 1), column) = (axis & 4u) != 0 ? -1.0 : 1.0;
  }
  return Quaternion(turned);
}

Cuboid HalfCellBox::cuboid(double half) const {
  Cuboid cuboid;
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    cuboid.center[i] = half * (0.5 * static_cast<double>(middle[k]));
    cuboid.size[i] = half * static_cast<double>(size[k]);
  }
  cuboid.orientation = orientation();
  return cuboid;
}

std::optional<HalfCellBox> HalfCellBox::from(const Cuboid& wanted, double half) {
  constexpr double kFarthest = 1e15;
  HalfCellBox box;
  for (int i = 0; i < 3; ++i) {
    const double middle = 2.0 * wanted.center[i] / half;
    const double size = wanted.size[i] / half;
    if (!(std::abs(middle) < kFarthest) || !(std::abs(size) < kFarthest)) return {};
    box.middle[static_cast<std::size_t>(i)] = std::llround(middle);
    box.size[static_cast<std::size_t>(i)] = std::llround(size);
  }
  box.axes = axesOf(wanted.orientation);
  const Cuboid made = box.cuboid(half);
  for (int i = 0; i < 3; ++i) {
    if (!isSame(made.center[i], wanted.center[i]) || !isSame(made.size[i], wanted.size[i])) {
      return {};
    }
  }
  for (int i = 0; i < 4; ++i) {
    if (!isSame(made.orientation.coeffs()[i], wanted.orientation.coeffs()[i])) return {};
  }
  return box;
}

}  // namespace planar_mapping::detail
