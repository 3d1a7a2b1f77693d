// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <string>

namespace planar_mapping::io {

/// Shortest text that reads back as the same value; std::to_chars knows no locale.
template <typename Number>
void appendNumber(std::string& out, Number value) {
  char text[40];
  const std::to_chars_result end = std::to_chars(text, text + sizeof text, value);
  out.append(text, end.ptr);
}

}  // namespace planar_mapping::io
