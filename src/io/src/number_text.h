// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <initializer_list>
#include <string>

namespace planar_mapping::io {

/// Shortest text that reads back as the same value; std::to_chars knows no locale.
template <typename Number>
void appendNumber(std::string& out, Number value) {
  char text[40];
  const std::to_chars_result end = std::to_chars(text, text + sizeof text, value);
  out.append(text, end.ptr);
}

inline void appendNumbers(std::string& out, std::initializer_list<double> values,
                          const char* separator) {
  bool first = true;
  for (const double value : values) {
    if (!first) out += separator;
    first = false;
    appendNumber(out, value);
  }
}

}  // namespace planar_mapping::io
