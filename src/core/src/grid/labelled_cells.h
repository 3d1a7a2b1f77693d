// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace planar_mapping::detail {

/// A cubic grid cell of one plane (label); label -1 = on no plane.
struct LabelledCell {
  std::int32_t label = -1;
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::int32_t z = 0;
  bool operator==(const LabelledCell& o) const {
    return label == o.label && x == o.x && y == o.y && z == o.z;
  }
};

/// Numbers cells from 0 in order of appearance.
class LabelledCells {
 public:
  LabelledCells();
  std::int32_t insert(const LabelledCell& cell);
  const std::vector<LabelledCell>& cells() const { return cells_; }

 private:
  std::size_t slotOf(const LabelledCell& cell) const;
  void grow();

  std::vector<LabelledCell> cells_;
  std::vector<std::int32_t> slots_;  ///< number of the cell, or -1; size is a power of two
};

}  // namespace planar_mapping::detail
