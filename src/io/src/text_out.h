// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <string>

namespace planar_mapping {
namespace io {

/// The shortest text that reads back as the same number, whatever the locale.
template <typename T>
void appendNumber(std::string& text, T value) {
  char buffer[32];
  const std::to_chars_result result = std::to_chars(buffer, buffer + sizeof buffer, value);
  text.append(buffer, result.ptr);
}

}  // namespace io
}  // namespace planar_mapping
