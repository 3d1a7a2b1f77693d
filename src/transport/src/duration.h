// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <locale>
#include <sstream>
#include <string>

namespace planar_mapping::transport::detail {

using Clock = std::chrono::steady_clock;

inline Clock::duration seconds(double value) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(value));
}

inline double secondsBetween(Clock::time_point first, Clock::time_point last) {
  return std::chrono::duration<double>(last - first).count();
}

/// "30 s", "0.5 s"
inline std::string secondsText(double value) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << value << " s";
  return text.str();
}

}  // namespace planar_mapping::transport::detail
