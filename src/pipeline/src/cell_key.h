// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "planar_mapping/core/types.h"

namespace planar_mapping::detail {

/// The cell of a grid as one number, 21 bits an axis. Cells two million apart share a number, and
/// so do all that are beyond any grid.
inline std::uint64_t cellKey(const Vector3& point, double side) {
  constexpr double kBeyond = 1e15;
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double cell = std::floor(point[axis] / side);
    const std::int64_t number = std::abs(cell) < kBeyond ? static_cast<std::int64_t>(cell) : 0;
    key = (key << 21u) | (static_cast<std::uint64_t>(number) & 0x1FFFFFu);
  }
  return key;
}

/// Where a hash table of 2^n slots starts to look for a key; mask = 2^n - 1.
inline std::size_t slotOfKey(std::uint64_t key, std::size_t mask) {
  key = (key ^ (key >> 32u)) * 0x9E3779B97F4A7C15ULL;
  return (key ^ (key >> 29u)) & mask;
}

}  // namespace planar_mapping::detail
