// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "packed_boxes.h"

#include <array>
#include <cmath>
#include <cstring>
#include <optional>

#include "packed_numbers.h"

namespace planar_mapping::detail {
namespace {

bool isSame(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

/// A box on the lattice of half cells.
struct LatticeBox {
  std::array<std::int64_t, 3> middle{};  ///< twice, in half cells
  std::array<std::int64_t, 3> size{};    ///< along the box's own axes, half cells
  unsigned axes = 0;  ///< of u, v, n: that of the world and its sign; 0 = x, y, z

  /// The orientation by the axes of the world that u, v and n are.
  static unsigned axesOf(const Quaternion& orientation) {
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
  Quaternion orientation() const {
    if (axes == 0) return Quaternion::Identity();
    Matrix3 turned = Matrix3::Zero();
    for (int column = 0; column < 3; ++column) {
      const unsigned axis = axes >> (3 * column) & 7u;
      turned(static_cast<int>((axis & 3u) - 1), column) = (axis & 4u) != 0 ? -1.0 : 1.0;
    }
    return Quaternion(turned);
  }
  Cuboid cuboid(double half) const {
    Cuboid cuboid;
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      cuboid.center[i] = half * (0.5 * static_cast<double>(middle[k]));
      cuboid.size[i] = half * static_cast<double>(size[k]);
    }
    cuboid.orientation = orientation();
    return cuboid;
  }
  /// Nothing unless cuboid() gives the very same.
  static std::optional<LatticeBox> from(const Cuboid& wanted, double half) {
    constexpr double kFarthest = 1e15;
    LatticeBox box;
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
};

constexpr unsigned kOnLattice = 1;
constexpr unsigned kCertain = 2;

}  // namespace

PackedBoxes::PackedBoxes(const std::vector<Cuboid>& boxes, double cell)
    : size_(static_cast<std::uint32_t>(boxes.size())) {
  const double half = 0.5 * cell;
  PackWriter out;
  std::array<std::int64_t, 3> last{};
  for (const Cuboid& c : boxes) {
    const std::optional<LatticeBox> box = LatticeBox::from(c, half);
    const bool certain = c.probability == 1.0f;
    out.byte((box ? kOnLattice : 0) | (certain ? kCertain : 0));
    out.difference(c.plane_id);
    if (!certain) out.raw(c.probability);
    if (box) {
      out.number(box->axes);
      for (std::size_t i = 0; i < 3; ++i) {
        out.difference(box->middle[i] - last[i]);
        out.difference(box->size[i]);
      }
      last = box->middle;
      continue;
    }
    for (int i = 0; i < 3; ++i) {
      out.raw(c.center[i]);
      out.raw(c.size[i]);
    }
    for (int i = 0; i < 4; ++i) out.raw(c.orientation.coeffs()[i]);
  }
  bytes_ = PackedBytes(out.bytes);
}

void PackedBoxes::appendTo(std::vector<Cuboid>& boxes, double cell) const {
  const double half = 0.5 * cell;
  PackReader in(bytes_.data());
  std::array<std::int64_t, 3> last{};
  for (std::uint32_t n = 0; n < size_; ++n) {
    const unsigned head = in.byte();
    const auto plane_id = in.differenceAs<std::int32_t>();
    const float probability = (head & kCertain) != 0 ? 1.0f : in.raw<float>();
    Cuboid c;
    if ((head & kOnLattice) != 0) {
      LatticeBox box;
      box.axes = in.as<unsigned>();
      for (std::size_t i = 0; i < 3; ++i) {
        last[i] += in.difference();
        box.size[i] = in.difference();
      }
      box.middle = last;
      c = box.cuboid(half);
    } else {
      for (int i = 0; i < 3; ++i) {
        c.center[i] = in.raw<double>();
        c.size[i] = in.raw<double>();
      }
      for (int i = 0; i < 4; ++i) c.orientation.coeffs()[i] = in.raw<double>();
    }
    c.plane_id = plane_id;
    c.probability = probability;
    boxes.push_back(c);
  }
}

}  // namespace planar_mapping::detail
