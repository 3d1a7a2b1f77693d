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

void FreeColumns::mark(std::size_t cell, const Steps& steps) {
  std::uint64_t* const column = bits_.data() + words_ * cell;
  for (int word = steps.first / 64; 64 * word < steps.last; ++word)
    column[word] |= maskOf(word, steps);
}

std::uint64_t FreeColumns::maskOf(int word, const Steps& steps) {
  const int low = std::max(steps.first - 64 * word, 0);
  const int high = std::min(steps.last - 64 * word, 64);
  if (low >= high) return 0;
  return (~std::uint64_t{0} >> (64 - (high - low))) << low;
}

void FreeColumns::invert() {
  for (std::uint64_t& word : bits_) word = ~word;
}

FreeColumns::Count FreeColumns::count(std::size_t cell, double from, double to) const {
  const Steps steps = stepsOf(from, to);
  Count count;
  count.all = std::max(steps.last - steps.first, 0);
  const std::uint64_t* const column = bits_.data() + words_ * cell;
  for (int word = steps.first / 64; 64 * word < steps.last; ++word)
    count.free += __builtin_popcountll(column[word] & maskOf(word, steps));
  return count;
}

}  // namespace planar_mapping::detail
