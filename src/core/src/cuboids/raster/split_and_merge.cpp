// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <tuple>
#include <utility>

#include "planar_mapping/core/base/detail/summed_area.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/cuboids/raster/detail/plane_raster.h"

namespace planar_mapping {
namespace {

/// The smallest rectangle around the occupied cells; zero area if there are none.
CellRectangle boundingRectangle(const CellMask& mask) {
  CellRectangle box{mask.width, mask.height, 0, 0};
  std::int32_t last_a = -1;
  std::int32_t last_b = -1;
  for (std::int32_t b = 0; b < mask.height; ++b) {
    for (std::int32_t a = 0; a < mask.width; ++a) {
      if (!mask.at(a, b)) continue;
      box.a = std::min(box.a, a);
      box.b = std::min(box.b, b);
      last_a = std::max(last_a, a);
      last_b = b;
    }
  }
  if (last_a < 0) return {};
  box.width = last_a - box.a + 1;
  box.height = last_b - box.b + 1;
  return box;
}

struct Quartering {
  const detail::SummedArea<std::int64_t>& occupied;
  double density_threshold;
  int min_width;
  int min_height;
  std::vector<CellRectangle>& leaves;

  // Depth is at most 31: both sides halve.
  void split(const CellRectangle& unit) const {
    const std::int64_t count =
        occupied.over(unit.a, unit.b, unit.a + unit.width, unit.b + unit.height);
    if (count == 0) return;
    const double density = static_cast<double>(count) / static_cast<double>(unit.area());
    if (!(density < density_threshold && unit.width > min_width && unit.height > min_height)) {
      leaves.push_back(unit);
      return;
    }
    const std::int32_t w = unit.width / 2;
    const std::int32_t h = unit.height / 2;
    split({unit.a, unit.b, w, h});
    split({unit.a + w, unit.b, unit.width - w, h});
    split({unit.a, unit.b + h, w, unit.height - h});
    split({unit.a + w, unit.b + h, unit.width - w, unit.height - h});
  }
};

void mergeAlongU(std::vector<CellRectangle>& rectangles) {
  std::sort(rectangles.begin(), rectangles.end(), [](const auto& l, const auto& r) {
    return std::tie(l.b, l.height, l.a) < std::tie(r.b, r.height, r.a);
  });
  std::vector<CellRectangle> merged;
  for (const CellRectangle& r : rectangles) {
    if (!merged.empty()) {
      CellRectangle& last = merged.back();
      if (last.b == r.b && last.height == r.height && last.a + last.width == r.a) {
        last.width += r.width;
        continue;
      }
    }
    merged.push_back(r);
  }
  rectangles = std::move(merged);
}

void swapAxes(std::vector<CellRectangle>& rectangles) {
  for (CellRectangle& r : rectangles) r = {r.b, r.a, r.height, r.width};
}

}  // namespace

std::vector<CellRectangle> splitAndMerge(const CellMask& mask, double density_threshold,
                                         int min_width, int min_height, bool merge) {
  detail::requireConsistent(mask);
  requirePositive("density_threshold", density_threshold);
  requireInRange("min_width", min_width, 1, 2147483647, "cells");
  requireInRange("min_height", min_height, 1, 2147483647, "cells");
  std::vector<CellRectangle> rectangles;
  const CellRectangle whole = boundingRectangle(mask);
  if (whole.area() == 0) return rectangles;
  const detail::SummedArea<std::int64_t> occupied(mask.cells, mask.width, mask.height, 0);
  Quartering{occupied, density_threshold, min_width, min_height, rectangles}.split(whole);
  if (merge) {
    mergeAlongU(rectangles);
    swapAxes(rectangles);
    mergeAlongU(rectangles);
    swapAxes(rectangles);
  }
  for (CellRectangle& r : rectangles) {
    r.a += mask.a0;
    r.b += mask.b0;
  }
  std::sort(rectangles.begin(), rectangles.end(),
            [](const auto& l, const auto& r) { return std::tie(l.b, l.a) < std::tie(r.b, r.a); });
  return rectangles;
}

}  // namespace planar_mapping
