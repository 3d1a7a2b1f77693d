// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "commands.h"
#include "planar_mapping/core/base/types.h"

// What several commands do alike.
namespace planar_mapping::tools {

inline nlohmann::ordered_json toJson(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

/// \throws UsageError if there is a file and it must not be overwritten
inline void requireNew(const std::string& path, bool force) {
  std::error_code ignored;
  if (!force && std::filesystem::exists(path, ignored)) {
    throw UsageError("'" + path + "' exists; --force overwrites it");
  }
}

/// Exactly N finite numbers with commas between them. \throws UsageError naming the option
template <std::size_t N>
std::array<double, N> numbersOf(const std::string& option, const std::string& text) {
  std::array<double, N> numbers{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < N; ++i) {
    const std::from_chars_result read = std::from_chars(at, end, numbers[i]);
    const bool last = i + 1 == N;
    if (read.ec != std::errc() || !std::isfinite(numbers[i]) ||
        (last ? read.ptr != end : read.ptr == end || *read.ptr != ',')) {
      throw UsageError(option + " is '" + text + "', but must be " + std::to_string(N) +
                       " finite numbers with commas between them");
    }
    at = read.ptr + 1;
  }
  return numbers;
}

}  // namespace planar_mapping::tools
