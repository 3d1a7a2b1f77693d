// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "standard_cells.h"

#include <utility>

#include "cell_key.h"

namespace planar_mapping::detail {

void StandardCells::add(const Vector3& point) {
  const std::uint64_t key = cellKey(point, resolution_);
  if (key + 1 == last_) return;
  last_ = key + 1;
  if (2 * (size_ + 1) > slots_.size()) grow();
  insert(key + 1);
}

void StandardCells::insert(std::uint64_t stored) {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = slotOfKey(stored, mask);
  while (slots_[slot] != 0) {
    if (slots_[slot] == stored) return;
    slot = (slot + 1) & mask;
  }
  slots_[slot] = stored;
  ++size_;
}

void StandardCells::grow() {
  std::vector<std::uint64_t> old(slots_.empty() ? 1024 : 2 * slots_.size(), 0);
  std::swap(old, slots_);
  size_ = 0;
  for (const std::uint64_t stored : old) {
    if (stored != 0) insert(stored);
  }
}

}  // namespace planar_mapping::detail
