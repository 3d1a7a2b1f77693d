// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "printable.h"

#include <cstdint>

namespace planar_mapping::transport::detail {
namespace {

/// Bytes of the UTF-8 sequence that starts at i, or 0 if none does.
std::size_t sequenceLength(const std::string& text, std::size_t i) {
  const auto byte = [&text](std::size_t k) { return static_cast<std::uint8_t>(text[k]); };
  const std::uint8_t first = byte(i);
  std::size_t length = 1;
  if (first >= 0x80) length = first >= 0xC2 && first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  if ((first >= 0x80 && first < 0xC2) || first > 0xF4 || i + length > text.size()) return 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(i + k) & 0xC0) != 0x80) return 0;
  }
  // Overlong forms, surrogates and what lies beyond the last code point.
  if (length == 3 &&
      ((first == 0xE0 && byte(i + 1) < 0xA0) || (first == 0xED && byte(i + 1) > 0x9F)))
    return 0;
  if (length == 4 &&
      ((first == 0xF0 && byte(i + 1) < 0x90) || (first == 0xF4 && byte(i + 1) > 0x8F)))
    return 0;
  return length;
}

/// C0 and C1 control characters and DEL.
bool isControl(const std::string& text, std::size_t i, std::size_t length) {
  const auto first = static_cast<std::uint8_t>(text[i]);
  if (length == 1) return first < 0x20 || first == 0x7F;
  return length == 2 && first == 0xC2 && static_cast<std::uint8_t>(text[i + 1]) < 0xA0;
}

}  // namespace

std::string printable(const std::string& text) {
  std::string result;
  result.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = sequenceLength(text, i);
    if (length == 0 || isControl(text, i, length)) {
      result += '?';
      i += length > 0 ? length : 1;
    } else {
      result.append(text, i, length);
      i += length;
    }
  }
  return result;
}

}  // namespace planar_mapping::transport::detail
