// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "planar_mapping/core/geometry/cuboid.h"

namespace planar_mapping::detail {

/// A box on the lattice of half cells, whose axes are those of the world, however they are named.
struct HalfCellBox {
  std::array<std::int64_t, 3> middle{};  ///< twice, in half cells
  std::array<std::int64_t, 3> size{};    ///< along the box's own axes, half cells
  unsigned axes = 0;  ///< of u, v, n: that of the world and its sign, three bits each; 0 = x, y, z

  /// Nothing unless cuboid() gives the very same. \param half  side of half a cell, metres
  static std::optional<HalfCellBox> from(const Cuboid& wanted, double half);
  Cuboid cuboid(double half) const;

 private:
  Quaternion orientation() const;
};

}  // namespace planar_mapping::detail
