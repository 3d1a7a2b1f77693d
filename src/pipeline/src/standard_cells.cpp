// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "standard_cells.h"

#include <utility>

#include "cell_key.h"

namespace planar_mapping::detail {

void StandardCells::add(const Vector3& point) {
  const std::uint64_t stored = cellKey(point, resolution_) + 1;
  if (slots_.empty() || slots_[last_].key != stored) {
    if (2 * (size_ + 1) > slots_.size()) grow();
    last_ = slotOf(stored);
    if (slots_[last_].key == 0) ++size_;
    slots_[last_].key = stored;
  }
  Cell& cell = slots_[last_];
  ++cell.points;
  if ((cell.points & (cell.points - 1)) != 0) return;
  for (int axis = 0; axis < 3; ++axis) cell.point[axis] = static_cast<float>(point[axis]);
}

std::size_t StandardCells::slotOf(std::uint64_t stored) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = slotOfKey(stored, mask);
  while (slots_[slot].key != 0 && slots_[slot].key != stored) slot = (slot + 1) & mask;
  return slot;
}

void StandardCells::grow() {
  std::vector<Cell> old(slots_.empty() ? 1024 : 2 * slots_.size());
  std::swap(old, slots_);
  for (const Cell& cell : old) {
    if (cell.key != 0) slots_[slotOf(cell.key)] = cell;
  }
}

}  // namespace planar_mapping::detail
