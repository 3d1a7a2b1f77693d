// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>

namespace planar_mapping::test {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr float kNanFloat = std::numeric_limits<float>::quiet_NaN();
inline constexpr double kDegree = M_PI / 180.0;  ///< in radians

}  // namespace planar_mapping::test
