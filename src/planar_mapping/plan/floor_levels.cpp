// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/plan/floor_levels.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "planar_mapping/base/error.h"

namespace planar_mapping::detail {

FreeColumns::FreeColumns(const PlanRaster& raster, double low, double high, double step)
    : low_(step * std::floor(low / step)), step_(step) {
  constexpr double kMaxWords = 1 << 26;  // half a gigabyte
  const double steps = std::ceil((high - low_) / step) + 1.0;
  if (!(double(raster.count()) * (steps / 64.0 + 1.0) <= kMaxWords)) {
    throw ParameterError("cells of " + std::to_string(raster.cell) +
                         " m are too small for a plan of this map; take a larger --cell");
  }
  steps_ = int(steps);
  words_ = std::size_t(steps_ + 63) / 64;
  bits_.assign(words_ * raster.count(), 0);
}

int FreeColumns::stepAbove(double height) const {
  return int(std::clamp(std::ceil((height - low_) / step_ - 0.5 - 1e-6), 0.0, double(steps_)));
}

void FreeColumns::mark(std::size_t cell, double from, double to) {
  const int last = stepAbove(to);
  std::uint64_t* const column = bits_.data() + words_ * cell;
  for (int i = stepAbove(from); i < last; ++i) column[i / 64] |= std::uint64_t{1} << (i % 64);
}

void FreeColumns::invert() {
  for (std::uint64_t& word : bits_) word = ~word;
}

FreeColumns::Count FreeColumns::count(std::size_t cell, double from, double to) const {
  Count count;
  const int last = stepAbove(to);
  const std::uint64_t* const column = bits_.data() + words_ * cell;
  for (int i = stepAbove(from); i < last; ++i) {
    ++count.all;
    count.free += int(column[i / 64] >> (i % 64) & 1U);
  }
  return count;
}

}  // namespace planar_mapping::detail
