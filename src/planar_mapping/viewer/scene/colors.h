// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/cuboid.h"

namespace planar_mapping {

/// 8-bit sRGB.
struct Color {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;
  bool operator==(const Color& o) const {
    return red == o.red && green == o.green && blue == o.blue;
  }
  bool operator!=(const Color& o) const { return !(*this == o); }
};

/// What the colour of a cuboid tells.
enum class ColorBy { Plane, Height, Probability, State, Tilt };

PLANAR_MAPPING_EXPORT const char* toString(ColorBy color);
/// \throws ParameterError listing the words there are
PLANAR_MAPPING_EXPORT ColorBy colorByFromString(const std::string& word);

/// `#rrggbb`, or one of white, black, gray, light, dark.
/// \throws ParameterError
PLANAR_MAPPING_EXPORT Color colorFromString(const std::string& text);

/// [ours] Categorical colour of a plane: depends on the id alone, so that it is the same in every
/// picture; neighbouring ids lie 137.5 degrees of hue apart. Negative ids (non-planar) are gray.
PLANAR_MAPPING_EXPORT Color planeColor(std::int32_t plane_id);

/// Colour of a state in `--color state` and in the 2-D projection's legend.
PLANAR_MAPPING_EXPORT Color stateColor(CellState state);

/// Scale from blue to red for height, viridis for tilt, plasma for probability; the value is
/// clamped to [0, 1], NaN counts as 0.
PLANAR_MAPPING_EXPORT Color scaleColor(ColorBy color, double value);

/// The range of values of a scalar colour mode.
struct PLANAR_MAPPING_EXPORT ScalarRange {
  double low = 0.0;
  double high = 1.0;
  /// Position of the value in the range, in [0, 1]; 0 for an empty range.
  double normalized(double value) const;
};

}  // namespace planar_mapping
