// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/core/base/types.h"
#include "planar_mapping/evaluation/detail/cell_key.h"

namespace planar_mapping::detail {

/// The cells of a standard grid that points fell into: A_S of the combination efficiency, and for
/// each cell one of its points.
class StandardCells {
 public:
  struct Cell {
    std::size_t points = 0;
    float point[3] = {0.0f, 0.0f, 0.0f};  ///< one of them: the last that made their number 2^n
  };

  explicit StandardCells(double resolution = 1.0) : resolution_(resolution) {}
  /// World frame, metres. What is beyond the grid, as it is beyond any map, is left out.
  void add(const Vector3& point) {
    std::uint64_t key = 0;
    if (!evaluation::detail::cellKeyOf(point, resolution_, key)) return;
    Cell& cell = cells_[key];
    ++cell.points;
    if ((cell.points & (cell.points - 1)) != 0) return;
    for (int axis = 0; axis < 3; ++axis) cell.point[axis] = static_cast<float>(point[axis]);
  }
  std::size_t size() const { return cells_.size(); }
  /// Occupied cells; neighbours along x come one after the other.
  template <typename Visitor>
  void forEach(const Visitor& visit) const {
    std::vector<std::uint64_t> keys = cells_.keys();
    std::sort(keys.begin(), keys.end());
    for (const std::uint64_t key : keys) visit(*cells_.find(key));
  }
  template <typename Archive>
  void visitState(Archive& archive) {
    std::uint64_t count = cells_.size();
    archive(resolution_, count);
    for (std::uint64_t i = 0; i < count; ++i) {
      std::uint64_t key = Archive::kReads ? 0 : cells_.key(i);
      Cell cell = Archive::kReads ? Cell() : cells_.value(i);
      archive(key, cell);
      if (Archive::kReads) cells_[key] = cell;
    }
  }

 private:
  double resolution_;
  KeyMap<Cell> cells_;
};

}  // namespace planar_mapping::detail
