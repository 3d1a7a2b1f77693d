// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "grid/labelled_cells.h"

namespace planar_mapping::detail {
namespace {

std::uint64_t mix(std::uint64_t h, std::int32_t value) {
  h = (h ^ static_cast<std::uint32_t>(value)) * 0x9E3779B97F4A7C15ULL;
  return h ^ (h >> 29u);
}

}  // namespace

LabelledCells::LabelledCells() : slots_(1024, -1) {}

std::size_t LabelledCells::slotOf(const LabelledCell& cell) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = mix(mix(mix(mix(0, cell.x), cell.y), cell.z), cell.label) & mask;
  while (slots_[slot] >= 0 && !(cells_[slots_[slot]] == cell)) slot = (slot + 1) & mask;
  return slot;
}

std::int32_t LabelledCells::insert(const LabelledCell& cell) {
  std::size_t slot = slotOf(cell);
  if (slots_[slot] >= 0) return slots_[slot];
  if (2 * (cells_.size() + 1) > slots_.size()) {
    grow();
    slot = slotOf(cell);
  }
  slots_[slot] = static_cast<std::int32_t>(cells_.size());
  cells_.push_back(cell);
  return slots_[slot];
}

void LabelledCells::grow() {
  std::vector<std::int32_t>(2 * slots_.size(), -1).swap(slots_);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    slots_[slotOf(cells_[i])] = static_cast<std::int32_t>(i);
  }
}

}  // namespace planar_mapping::detail
