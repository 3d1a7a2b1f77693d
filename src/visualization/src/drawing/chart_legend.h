// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "drawing/canvas.h"
#include "planar_mapping/visualization/charts.h"

namespace planar_mapping::visualization {

/// Lines, markers and names, centred below the charts of a page, in as many rows as they need.
class ChartLegend {
 public:
  /// \param width  of the page, pixels
  ChartLegend(const std::vector<ChartSeries>& series, double width);
  int height() const;
  void draw(double top, Canvas& canvas) const;

 private:
  double width_;
  std::vector<std::vector<ChartSeries>> rows_;
};

}  // namespace planar_mapping::visualization
