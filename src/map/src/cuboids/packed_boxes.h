// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "store/packed_bytes.h"
#include "planar_mapping/core/geometry/cuboid.h"

namespace planar_mapping::detail {

/// Occupied cuboids in few bytes, each exactly as it was: about 16 for a box on the lattice of half
/// cells with the axes of the world, however they are named; others as they are.
class PackedBoxes {
 public:
  PackedBoxes() = default;
  /// \param cell metres; the same must be given to appendTo()
  PackedBoxes(const std::vector<Cuboid>& boxes, double cell);
  std::size_t size() const { return size_; }
  void appendTo(std::vector<Cuboid>& boxes, double cell) const;
  std::size_t memoryBytes() const { return bytes_.memoryBytes(); }

 private:
  std::uint32_t size_ = 0;
  PackedBytes bytes_;
};

}  // namespace planar_mapping::detail
