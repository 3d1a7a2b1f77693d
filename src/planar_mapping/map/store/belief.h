// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace planar_mapping::detail {

// Beliefs of cells are whole steps, k / 17, in memory as in the file: what is saved is what the
// live map answers. Finer ones would be most of a file, and nothing is decided by them.
constexpr std::uint8_t kCertain = 17;

inline std::uint8_t quantiseBelief(double p) {
  return static_cast<std::uint8_t>(std::lround(kCertain * std::clamp(p, 0.0, 1.0)));
}
inline float beliefOf(std::uint8_t k) {
  return static_cast<float>(k) / kCertain;
}

/// Belief after the cell was seen again with belief \p q: the newest frame counts for \p gain, and
/// where q is a step away or more, for a step.
inline std::uint8_t afterHit(std::uint8_t before, double q, double gain) {
  const double apart = kCertain * std::clamp(q, 0.0, 1.0) - before;
  const long step = std::lround(gain * apart);
  if (step != 0 || std::abs(apart) < 1.0) return static_cast<std::uint8_t>(before + step);
  return static_cast<std::uint8_t>(apart > 0.0 ? before + 1 : before - 1);
}
/// Belief after the sensor looked through the cell; rounded down, or it might never be lost.
inline std::uint8_t afterMiss(std::uint8_t before, double factor) {
  return static_cast<std::uint8_t>(before * factor);
}
/// Belief after two maps saw the cell apart from each other: their log odds are added. No less than
/// both: neither map gave the cell up.
inline std::uint8_t joinedBelief(std::uint8_t a, std::uint8_t b) {
  const double for_it = static_cast<double>(a) * b;
  const double against = static_cast<double>(kCertain - a) * (kCertain - b);
  const double p = for_it > 0.0 ? for_it / (for_it + against) : 0.0;
  return std::max(std::min(a, b), quantiseBelief(p));
}
/// Does a cell of this belief stay in the map?
inline bool isKept(std::uint8_t k, double min_probability) {
  return k > 0 && static_cast<double>(k) / kCertain >= min_probability;
}

}  // namespace planar_mapping::detail
