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
  explicit StandardCells(double resolution) : resolution_(resolution) {}
  /// World frame, metres.
  void add(const Vector3& point);
  std::size_t size() const { return size_; }

 private:
  void insert(std::uint64_t key);
  void grow();

  double resolution_;
  std::vector<std::uint64_t> slots_;  ///< 0 = free, else key + 1
  std::size_t size_ = 0;
  std::uint64_t last_ = 0;  ///< neighbouring points are mostly in the same cell
};

}  // namespace planar_mapping::detail
