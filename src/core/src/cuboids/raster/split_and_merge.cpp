// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <tuple>
#include <utility>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/cuboids/raster/detail/plane_raster.h"

namespace planar_mapping {
namespace {

/// Number of occupied cells in any window, in constant time.
class SummedArea {
 public:
  explicit SummedArea(const CellMask& mask)
      : pitch_(static_cast<std::size_t>(mask.width) + 1),
        sum_(pitch_ * (static_cast<std::size_t>(mask.height) + 1), 0) {
    for (std::int32_t b = 0; b < mask.height; ++b) {
      const std::uint8_t* cells = mask.cells.data() + static_cast<std::size_t>(b) * mask.width;
      const std::int64_t* below = &sum_[static_cast<std::size_t>(b) * pitch_];
      std::int64_t* out = &sum_[(static_cast<std::size_t>(b) + 1) * pitch_];
      std::int64_t in_row = 0;
      for (std::int32_t a = 0; a < mask.width; ++a) {
        in_row += cells[a] != 0;
        out[a + 1] = below[a + 1] + in_row;
      }
    }
  }

  std::int64_t count(const CellRectangle& r) const {
    return at(r.a + r.width, r.b + r.height) - at(r.a, r.b + r.height) - at(r.a + r.width, r.b) +
           at(r.a, r.b);
  }

 private:
  std::int64_t at(std::int32_t a, std::int32_t b) const {
    return sum_[static_cast<std::size_t>(b) * pitch_ + static_cast<std::size_t>(a)];
  }

  std::size_t pitch_;
  std::vector<std::int64_t> sum_;
};

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
  const SummedArea& occupied;
  double density_threshold;
  int min_width;
  int min_height;
  std::vector<CellRectangle>& leaves;

  // Depth is at most 31: both sides halve.
  void split(const CellRectangle& unit) const {
    const std::int64_t count = occupied.count(unit);
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
  const SummedArea occupied(mask);
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
