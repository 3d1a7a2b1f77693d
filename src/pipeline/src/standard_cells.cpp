// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "standard_cells.h"

#include <cmath>
#include <utility>

namespace planar_mapping::detail {
namespace {

std::uint64_t mixed(std::uint64_t key) {
  key ^= key >> 32u;
  key *= 0x9E3779B97F4A7C15ULL;
  return key ^ (key >> 29u);
}

}  // namespace

void StandardCells::add(const Vector3& point) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    // 21 bits an axis; what lies two million cells away or more shares cells, which is harmless.
    const double cell = std::floor(point[axis] / resolution_);
    const auto wrapped = static_cast<std::int64_t>(std::fmod(cell, 2097152.0)) & 0x1FFFFF;
    key = (key << 21u) | static_cast<std::uint64_t>(wrapped);
  }
  if (key + 1 == last_) return;
  last_ = key + 1;
  if (2 * (size_ + 1) > slots_.size()) grow();
  insert(key + 1);
}

void StandardCells::insert(std::uint64_t stored) {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = mixed(stored) & mask;
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
