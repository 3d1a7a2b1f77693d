// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "coverage.h"

#include <algorithm>
#include <cmath>

#include "cell_key.h"

namespace planar_mapping::detail {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;
constexpr double kMostCells = 1e5;  // of one box; a larger one is compared with every point

}  // namespace

CoverageIndex::CoverageIndex(const std::vector<Cuboid>& cuboids, double margin, double cell)
    : margin_(margin), cell_(cell) {
  boxes_.reserve(cuboids.size());
  for (const Cuboid& cuboid : cuboids) {
    boxes_.push_back(
        {cuboid.center, cuboid.orientation.toRotationMatrix().transpose(), 0.5 * cuboid.size});
    enter(static_cast<std::uint32_t>(boxes_.size() - 1));
  }
  std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.box < b.box;
  });
  std::size_t slots = 16;
  while (slots < 2 * entries_.size()) slots *= 2;
  first_entry_.assign(slots, kNone);
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (i > 0 && entries_[i].cell == entries_[i - 1].cell) continue;
    std::size_t slot = slotOfKey(entries_[i].cell, slots - 1);
    while (first_entry_[slot] != kNone) slot = (slot + 1) & (slots - 1);
    first_entry_[slot] = static_cast<std::uint32_t>(i);
  }
}

void CoverageIndex::enter(std::uint32_t index) {
  const Box& box = boxes_[index];
  const Vector3 grown = box.half + Vector3::Constant(margin_);
  const Vector3 reach = box.to_local.transpose().cwiseAbs() * grown;
  const Vector3 low = box.center - reach;
  const Vector3 count = ((2.0 * reach) / cell_).array().floor() + 2.0;
  if (!(count.prod() < kMostCells)) {
    large_.push_back(index);
    return;
  }
  const double half_cell = 0.5 * cell_;
  // A cell can only matter if the sphere around it meets the box.
  const double near = margin_ + half_cell * std::sqrt(3.0);
  for (double x = 0; x < count.x(); ++x) {
    for (double y = 0; y < count.y(); ++y) {
      for (double z = 0; z < count.z(); ++z) {
        const Vector3 corner = low + cell_ * Vector3(x, y, z);
        const Vector3 middle = ((corner / cell_).array().floor() * cell_ + half_cell).matrix();
        const Vector3 outside = ((box.to_local * (middle - box.center)).cwiseAbs() - box.half)
                                    .cwiseMax(Vector3::Zero());
        if (outside.norm() <= near) entries_.push_back({cellKey(middle, cell_), index});
      }
    }
  }
}

bool CoverageIndex::within(const Box& box, const Vector3& point) const {
  const Vector3 outside =
      ((box.to_local * (point - box.center)).cwiseAbs() - box.half).cwiseMax(Vector3::Zero());
  return outside.squaredNorm() <= margin_ * margin_;
}

bool CoverageIndex::covers(const Vector3& point) const {
  for (const std::uint32_t box : large_) {
    if (within(boxes_[box], point)) return true;
  }
  const std::uint64_t key = cellKey(point, cell_);
  const std::size_t mask = first_entry_.size() - 1;
  for (std::size_t slot = slotOfKey(key, mask); first_entry_[slot] != kNone;
       slot = (slot + 1) & mask) {
    std::size_t i = first_entry_[slot];
    if (entries_[i].cell != key) continue;
    for (; i < entries_.size() && entries_[i].cell == key; ++i) {
      if (within(boxes_[entries_[i].box], point)) return true;
    }
    return false;
  }
  return false;
}

}  // namespace planar_mapping::detail
