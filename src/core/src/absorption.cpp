// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "absorption.h"

#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {

void PlanarVolume::add(const PlaneFrame& frame, const CellMask& mask,
                       const std::vector<CellRectangle>& rectangles) {
  if (rectangles.empty()) return;
  Patch patch;
  patch.frame = frame;
  patch.covered = mask;
  std::fill(patch.covered.cells.begin(), patch.covered.cells.end(), std::uint8_t{0});
  for (const CellRectangle& r : rectangles) {
    for (std::int32_t b = r.b - mask.b0; b < r.b - mask.b0 + r.height; ++b) {
      std::uint8_t* row = &patch.covered.cells[static_cast<std::size_t>(b) * mask.width];
      std::fill_n(row + (r.a - mask.a0), r.width, std::uint8_t{1});
    }
  }
  patch.frame.origin = frame.fromPlane({mask.a0 / cells_per_metre_, mask.b0 / cells_per_metre_, 0});
  patch.width = mask.width / cells_per_metre_;
  patch.height = mask.height / cells_per_metre_;
  patches_.push_back(std::move(patch));
}

void PlanarVolume::candidates(const Vector3& center, double radius,
                              std::vector<std::int32_t>& patches) const {
  const double reach = radius + margin_;
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const Patch& patch = patches_[i];
    const Vector3 d = center - patch.frame.origin;
    const double height = patch.frame.n.dot(d);
    if (height > reach || height < -thickness_ - reach) continue;
    const double u = patch.frame.u.dot(d);
    if (u < -reach || u > patch.width + reach) continue;
    const double v = patch.frame.v.dot(d);
    if (v < -reach || v > patch.height + reach) continue;
    patches.push_back(static_cast<std::int32_t>(i));
  }
}

bool PlanarVolume::contains(std::int32_t patch_number, const Vector3& point) const {
  const Patch& patch = patches_[static_cast<std::size_t>(patch_number)];
  const Vector3 q = patch.frame.toPlane(point);
  if (q.z() > margin_ || q.z() < -thickness_ - margin_) return false;
  const double a = q.x() * cells_per_metre_;
  const double b = q.y() * cells_per_metre_;
  if (!(a > -1.0 && b > -1.0 && a < patch.covered.width + 1.0 && b < patch.covered.height + 1.0)) {
    return false;
  }
  // A box grows in its own axes: any covered cell within the margin along both.
  const auto low_a = static_cast<std::int32_t>(std::floor(a - margin_cells_));
  const auto low_b = static_cast<std::int32_t>(std::floor(b - margin_cells_));
  const auto high_a = static_cast<std::int32_t>(std::floor(a + margin_cells_));
  const auto high_b = static_cast<std::int32_t>(std::floor(b + margin_cells_));
  for (std::int32_t row = low_b; row <= high_b; ++row) {
    for (std::int32_t column = low_a; column <= high_a; ++column) {
      if (patch.covered.at(column, row)) return true;
    }
  }
  return false;
}

}  // namespace planar_mapping::detail
