// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "drawing/canvas.h"
#include "planar_mapping/visualization/charts.h"

namespace planar_mapping::visualization {

/// Lines, markers and names in one row, centred on a page of that width; \p y is its middle.
void drawChartLegend(const std::vector<ChartSeries>& series, double width, double y,
                     Canvas& canvas);

}  // namespace planar_mapping::visualization
