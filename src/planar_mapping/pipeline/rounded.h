// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <string>

#include "planar_mapping/pipeline/parameter.h"

namespace planar_mapping::detail {

/// A number for a message: 2.50 is "2.5".
inline std::string rounded(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  return formatNumber(std::round(scale * value) / scale);
}

/// "[x, y, z]"
inline std::string rounded(const Vector3& v, int decimals) {
  return "[" + rounded(v.x(), decimals) + ", " + rounded(v.y(), decimals) + ", " +
         rounded(v.z(), decimals) + "]";
}

}  // namespace planar_mapping::detail
