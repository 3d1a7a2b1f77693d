// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <tuple>

namespace planar_mapping::detail {

/// Integer coordinates of a cubic cell: it spans [x s, (x + 1) s) and so on.
struct Int3 {
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::int32_t z = 0;

  /// x, y or z for axis 0, 1, 2.
  std::int32_t& operator[](std::size_t axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  std::int32_t operator[](std::size_t axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  bool operator==(const Int3& o) const { return x == o.x && y == o.y && z == o.z; }
  bool operator!=(const Int3& o) const { return !(*this == o); }
  /// By z, then y, then x.
  bool operator<(const Int3& o) const { return std::tie(z, y, x) < std::tie(o.z, o.y, o.x); }
  /// The cell of twice the side that holds this one.
  Int3 parent() const { return {x >> 1, y >> 1, z >> 1}; }
};

}  // namespace planar_mapping::detail
