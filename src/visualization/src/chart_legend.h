// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkContextItem.h>
#include <vtkSmartPointer.h>

#include <vector>

#include "planar_mapping/visualization/charts.h"

namespace planar_mapping::visualization {

/// The marker as vtkPlotPoints names it.
int markerStyle(ChartSeries::Marker marker);

/// Lines, markers and names in one row, centred in the strip at the foot of a page.
vtkSmartPointer<vtkContextItem> makeChartLegend(std::vector<ChartSeries> series, int width,
                                                int height);

}  // namespace planar_mapping::visualization
