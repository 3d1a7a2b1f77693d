// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace planar_mapping::detail {

/// As std::erase_if() of C++20. \return how many are gone
template <typename T, typename Goes>
std::size_t eraseIf(std::vector<T>& items, const Goes& goes) {
  const auto kept = std::remove_if(items.begin(), items.end(), goes);
  const auto gone = static_cast<std::size_t>(items.end() - kept);
  items.erase(kept, items.end());
  return gone;
}

/// Sorts and keeps one of each.
template <typename T>
void makeDistinct(std::vector<T>& items) {
  std::sort(items.begin(), items.end());
  items.erase(std::unique(items.begin(), items.end()), items.end());
}

/// The value at a place of the sorted values, which are reordered.
template <typename T>
T ranked(std::vector<T>& values, std::size_t place) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The value of the nearest rank at a fraction of the sorted values, which are reordered; of at
/// least one.
inline double nearestRank(std::vector<double>& values, double fraction) {
  const double position = std::ceil(fraction * static_cast<double>(values.size()));
  return ranked(values, static_cast<std::size_t>(std::max(position, 1.0)) - 1);
}

}  // namespace planar_mapping::detail
