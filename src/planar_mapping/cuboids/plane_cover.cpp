// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/cuboids/plane_cover.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/base/error.h"

namespace planar_mapping {

void CuboidApproximationParams::validate() const {
  constexpr double kLargestLength = 1e6;  // metres; more is a mistake of units
  requireInRange("profile", static_cast<int>(profile), 0, static_cast<int>(Profile::Compact));
  requireInRange("resolution", resolution, 1e-4, kLargestLength, "m");
  requireInRange("thickness", thickness, 0.0, kLargestLength, "m");
  requirePositive("density_threshold", density_threshold);
  requireInRange("density_threshold", density_threshold, 0.0, 1.0);
  requireInRange("min_width", min_width, 0.0, kLargestLength, "m");
  requireInRange("min_height", min_height, 0.0, kLargestLength, "m");
  requireInRange("min_points_per_cell", min_points_per_cell, 1, 1e9);
  requireInRange("hole_size", hole_size, 0.0, kLargestLength, "m");
  requireInRange("absorption", absorption, 0.0, 0.5, "cells");
  requireInRange("rectangle_cells", rectangle_cells, 0.0, 1e9, "cells");
  requireInRange("threads", threads, 0, 4096);
  if (!up.allFinite() || !(up.norm() > 0.0)) {
    throw ParameterError("up", up.norm(), "a finite vector of length > 0");
  }
}

namespace detail {

int lengthInCells(double length, double resolution) {
  if (length <= 0.0) return 1;
  const double cells = std::round(length / resolution);
  return static_cast<int>(std::clamp(cells, 1.0, 2147483647.0));
}

double thicknessOf(const CuboidApproximationParams& params) {
  return params.thickness > 0.0 ? params.thickness : params.resolution;
}

void fillHoles(CellMask& mask, int side) {
  const std::int32_t width = mask.width;
  const std::int32_t height = mask.height;
  std::vector<std::uint8_t> seen(mask.cells.size(), 0);
  std::vector<std::size_t> hole;
  for (std::int32_t y = 0; y < height; ++y) {
    for (std::int32_t x = 0; x < width; ++x) {
      const std::size_t start = static_cast<std::size_t>(y) * width + x;
      if (mask.cells[start] || seen[start]) continue;
      hole.assign(1, start);
      seen[start] = 1;
      bool open = false;  // reaches the border of the window, which is outside
      std::int32_t low_x = x, high_x = x, high_y = y;
      for (std::size_t i = 0; i < hole.size(); ++i) {
        const auto cx = static_cast<std::int32_t>(hole[i] % static_cast<std::size_t>(width));
        const auto cy = static_cast<std::int32_t>(hole[i] / static_cast<std::size_t>(width));
        low_x = std::min(low_x, cx);
        high_x = std::max(high_x, cx);
        high_y = std::max(high_y, cy);
        open |= cx == 0 || cy == 0 || cx == width - 1 || cy == height - 1;
        const auto visit = [&](std::size_t cell) {
          if (mask.cells[cell] || seen[cell]) return;
          seen[cell] = 1;
          hole.push_back(cell);
        };
        if (cx > 0) visit(hole[i] - 1);
        if (cx + 1 < width) visit(hole[i] + 1);
        if (cy > 0) visit(hole[i] - static_cast<std::size_t>(width));
        if (cy + 1 < height) visit(hole[i] + static_cast<std::size_t>(width));
      }
      if (open || high_x - low_x + 1 > side || high_y - y + 1 > side) continue;
      for (const std::size_t cell : hole) mask.cells[cell] = 1;
    }
  }
}

}  // namespace detail
}  // namespace planar_mapping
