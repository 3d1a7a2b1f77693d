// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/absorption.h"

#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {

void PlanarVolume::add(const PlaneFrame& frame, const std::vector<CellRectangle>& rectangles) {
  if (rectangles.empty()) return;
  Patch patch;
  patch.frame = frame;
  CellMask& mask = patch.covered;
  mask.a0 = rectangles.front().a;
  mask.b0 = rectangles.front().b;
  std::int32_t end_a = mask.a0;
  std::int32_t end_b = mask.b0;
  for (const CellRectangle& r : rectangles) {
    mask.a0 = std::min(mask.a0, r.a);
    mask.b0 = std::min(mask.b0, r.b);
    end_a = std::max(end_a, r.a + r.width);
    end_b = std::max(end_b, r.b + r.height);
  }
  mask.width = end_a - mask.a0;
  mask.height = end_b - mask.b0;
  mask.cells.assign(static_cast<std::size_t>(mask.width) * mask.height, 0);
  for (const CellRectangle& r : rectangles) {
    for (std::int32_t b = r.b - mask.b0; b < r.b - mask.b0 + r.height; ++b) {
      std::uint8_t* row = &mask.cells[static_cast<std::size_t>(b) * mask.width];
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

void PlanarVolume::clearCovered(PlanePatch& patch, double s) const {
  if (patches_.empty()) return;
  std::vector<std::int32_t> near;
  const auto isHeld = [&](double a, double b) {
    const Vector3 corner = patch.frame.fromPlane({a * s, b * s, 0.0});
    return std::any_of(near.begin(), near.end(),
                       [&](std::int32_t i) { return contains(i, corner); });
  };
  for (std::int32_t b = 0; b < patch.mask.height; ++b) {
    for (std::int32_t a = 0; a < patch.mask.width; ++a) {
      if (!patch.mask.at(a, b)) continue;
      if (patch.mask.at(a - 1, b) && patch.mask.at(a + 1, b) && patch.mask.at(a, b - 1) &&
          patch.mask.at(a, b + 1)) {
        continue;
      }
      near.clear();
      candidates(patch.frame.fromPlane({(a + 0.5) * s, (b + 0.5) * s, 0.0}), s, near);
      if (near.empty()) continue;
      std::uint8_t& quarters = patch.quarters[static_cast<std::size_t>(b) * patch.mask.width +
                                              static_cast<std::size_t>(a)];
      for (int quarter = 0; quarter < 4; ++quarter) {
        if (!(quarters >> quarter & 1)) continue;
        const double low_a = a + 0.5 * (quarter & 1);
        const double low_b = b + 0.5 * (quarter >> 1);
        if (isHeld(low_a, low_b) && isHeld(low_a + 0.5, low_b) && isHeld(low_a, low_b + 0.5) &&
            isHeld(low_a + 0.5, low_b + 0.5)) {
          quarters = static_cast<std::uint8_t>(quarters & ~(1 << quarter));
        }
      }
    }
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
