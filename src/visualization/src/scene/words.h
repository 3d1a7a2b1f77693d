// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <utility>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::visualization {

/// Enumerations as words: one table per enumeration serves both directions and the message.
template <typename Enum, std::size_t N>
using Words = std::array<std::pair<Enum, const char*>, N>;

template <typename Enum, std::size_t N>
const char* wordOf(const Words<Enum, N>& words, Enum value) {
  for (const auto& [entry, word] : words) {
    if (entry == value) return word;
  }
  return "invalid";
}

template <typename Enum, std::size_t N>
Enum fromWord(const char* what, const Words<Enum, N>& words, const std::string& text) {
  std::string allowed;
  for (const auto& [entry, word] : words) {
    if (text == word) return entry;
    allowed += (allowed.empty() ? "" : ", ") + std::string(word);
  }
  throw ParameterError(std::string(what) + " is '" + text + "', but must be one of " + allowed);
}

}  // namespace planar_mapping::visualization
