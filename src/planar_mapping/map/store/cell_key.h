// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "planar_mapping/base/types.h"
#include "planar_mapping/map/store/key_map.h"

namespace planar_mapping::detail {

/// Bits it takes to tell \p values different values apart.
inline int bitsFor(double values) {
  return values <= 1.0 ? 0 : static_cast<int>(std::ceil(std::log2(values)));
}

inline std::size_t bytesOfBits(std::size_t count, int bits) {
  return (count * static_cast<std::size_t>(bits) + 7) / 8;
}

/// Low corner of the cell, in cells.
inline Vector3 cornerOf(std::uint64_t key) {
  const auto cell = unpackKey(key);
  return {static_cast<double>(cell.x), static_cast<double>(cell.y), static_cast<double>(cell.z)};
}

/// Key of the cell a point is in; false for points that are not finite or beyond the lattice.
inline bool cellKeyOf(const Vector3& point, double side, std::uint64_t& key) {
  const Vector3 cell = (point / side).array().floor();
  if (!(cell.array().abs() < static_cast<double>(kLatticeLimit)).all()) return false;
  key = packKey(toInt3(cell));
  return true;
}

}  // namespace planar_mapping::detail
