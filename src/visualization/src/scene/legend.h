// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/visualization/colors.h"
#include "scene/decorations.h"

namespace planar_mapping::visualization {

/// The values that colours stand for: range over the occupied cuboids, in the unit of the legend
/// (metres, degrees, 1). Probability runs from 0 to 1, tilt from 0 to 90 degrees.
ScalarRange scalarRange(const SceneContent& content, ColorBy color);
/// The number of a cuboid in that unit.
double scalarOf(const Cuboid& cuboid, ColorBy color, const Vector3& up);

/// What the colours mean, with units, at the right border; and what the map holds below it.
Props makeLegend(const SceneContent& content, const ViewOptions& options, bool on_dark,
                 Captions& captions);

/// A text in pixels from the lower left corner; for overlays.
vtkSmartPointer<vtkProp> makeText(const std::string& text, double x, double y, double pixels,
                                  bool on_dark, bool monospaced = false, bool centered = false);
/// A filled polygon, pixels relative to a place from the lower left corner.
vtkSmartPointer<vtkProp> makePolygon(const std::vector<Vector2>& outline, const Vector2& at,
                                     Color color, double opacity = 1.0);
/// A filled rectangle in pixels from the lower left corner.
vtkSmartPointer<vtkProp> makeRectangle(double x, double y, double width, double height, Color color,
                                       double opacity);

}  // namespace planar_mapping::visualization
