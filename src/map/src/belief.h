// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace planar_mapping::detail {

// Beliefs of cells live in one byte, k / 255, in memory as in the file: what is saved is what the
// live map answers.
inline std::uint8_t quantiseBelief(double p) {
  return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(p, 0.0, 1.0)));
}
inline float beliefOf(std::uint8_t k) {
  return static_cast<float>(k) / 255.0f;
}

/// Belief after the cell was seen again with belief \p q: the newest frame counts for \p gain.
inline std::uint8_t afterHit(std::uint8_t before, double q, double gain) {
  const double p = before / 255.0;
  return quantiseBelief(p + gain * (q - p));
}
/// Belief after the sensor looked through the cell.
inline std::uint8_t afterMiss(std::uint8_t before, double factor) {
  return quantiseBelief(before / 255.0 * factor);
}
/// Does a cell of this belief stay in the map?
inline bool isKept(std::uint8_t k, double min_probability) {
  return k > 0 && k / 255.0 >= min_probability;
}

}  // namespace planar_mapping::detail
