// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/viewer/scene/colors.h"
#include "planar_mapping/viewer/window/image.h"

namespace planar_mapping {

/// A line of a chart: medians with what they spread over. All vectors have the same length; a
/// value that is not finite leaves its point out.
struct ChartSeries {
  enum class Marker : std::uint8_t { Circle, Square, Diamond, Cross, Plus };
  std::string name;
  Color color;
  Marker marker = Marker::Circle;
  bool dashed = false;
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> low;   ///< empty = no spread
  std::vector<double> high;  ///< as low
};

/// Lines over one axis.
struct Chart {
  std::string title;
  std::string x_title;       ///< with its unit
  std::string y_title;       ///< with its unit
  bool logarithmic = false;  ///< y axis by powers of ten; values that are not positive are left out
  std::vector<ChartSeries> series;
};

/// A page of charts, row by row, with one legend for all of them at its foot.
struct PLANAR_MAPPING_EXPORT ChartPage {
  std::vector<Chart> charts;
  int columns = 2;         ///< >= 1
  int chart_width = 720;   ///< pixels, in [320, 4096]
  int chart_height = 520;  ///< pixels, in [240, 4096]

  /// \throws InputError without charts, for a chart without a value that can be drawn, or series
  ///         whose lengths disagree; ParameterError for a page of more than 16384 pixels on a side
  void validate() const;
};

/// Draws the page off screen, as renderSnapshot() draws maps.
/// \throws RenderError if nothing here can draw; InputError, ParameterError as validate()
PLANAR_MAPPING_EXPORT Image renderCharts(const ChartPage& page);

}  // namespace planar_mapping
