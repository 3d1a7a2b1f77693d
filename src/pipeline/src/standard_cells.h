// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/core/types.h"

namespace planar_mapping::detail {

/// The cells of a standard grid that points fell into: A_S of the combination efficiency. An open
/// addressing table of cell numbers, for a frame has as many points as a map has cells.
class StandardCells {
 public:
  struct Cell {
    std::uint64_t key = 0;  ///< + 1; 0 = free
    std::size_t points = 0;
    float point[3] = {0.0f, 0.0f, 0.0f};  ///< one of them: the last that made their number 2^n
  };

  explicit StandardCells(double resolution) : resolution_(resolution) {}
  /// World frame, metres.
  void add(const Vector3& point);
  std::size_t size() const { return size_; }
  /// Occupied cells; the order follows from the cells and the order in which they came.
  template <typename Visitor>
  void forEach(const Visitor& visit) const {
    for (const Cell& cell : slots_) {
      if (cell.key != 0) visit(cell);
    }
  }

 private:
  std::size_t slotOf(std::uint64_t stored) const;
  void grow();

  double resolution_;
  std::vector<Cell> slots_;
  std::size_t size_ = 0;
  std::size_t last_ = 0;  ///< slot; neighbouring points are mostly in the same cell
};

}  // namespace planar_mapping::detail
