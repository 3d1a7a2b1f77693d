// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkProp.h>
#include <vtkSmartPointer.h>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/viewer/scene/camera.h"
#include "planar_mapping/viewer/scene/colors.h"
#include "planar_mapping/viewer/scene/ground.h"
#include "planar_mapping/viewer/scene/scene_content.h"
#include "planar_mapping/viewer/scene/view_options.h"

namespace planar_mapping::visualization {

using Props = std::vector<vtkSmartPointer<vtkProp>>;

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

/// The lines of the grid.
Props makeGroundGrid(const GroundFrame& frame, const Vector3& origin, bool on_dark);
/// Numbers along the two sides of the grid that face the camera, with the axes' names.
Props makeRuler(const GroundFrame& frame, const Vector3& origin, const CameraView& view,
                int picture_width, int picture_height, bool on_dark, Captions captions);
/// The side of the lower left corner that they take, pixels.
double cornerAxesSide(int picture_width, int picture_height);
/// Small axes x, y, z of the map in the lower left corner.
Props makeCornerAxes(const CameraView& view, int picture_width, int picture_height, bool on_dark);
/// The path as a tube with an arrow, and the axes of some of its poses.
Props makeTrajectory(const SceneContent& content, const Vector3& origin);
/// An overlay cloud as points.
Props makeCloud(const SceneCloud& cloud, const Vector3& origin, double point_size);
/// The twelve edges of a cuboid, to mark it as picked.
Props makeOutline(const Cuboid& cuboid, const Vector3& origin);

}  // namespace planar_mapping::visualization
