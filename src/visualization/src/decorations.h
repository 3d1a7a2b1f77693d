// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkProp.h>
#include <vtkSmartPointer.h>

#include <string>
#include <vector>

#include "planar_mapping/core/types.h"
#include "planar_mapping/visualization/camera.h"
#include "planar_mapping/visualization/scene_content.h"
#include "planar_mapping/visualization/view_options.h"

namespace planar_mapping::visualization {

using Props = std::vector<vtkSmartPointer<vtkProp>>;

/// A round step (1, 2 or 5 times a power of ten) that cuts length into at most parts pieces.
double roundStep(double length, int parts);

/// The number without trailing zeros: "2.5", "0", "-12".
std::string shortNumber(double value);

/// Rectangle on the ground that the content stands on, in steps of the grid.
struct GroundFrame {
  Vector3 right = Vector3::UnitX();    ///< unit, horizontal
  Vector3 forward = Vector3::UnitY();  ///< unit, horizontal
  Vector3 up = Vector3::UnitZ();
  double height = 0.0;  ///< of the ground along up, metres
  double low_right = 0.0, high_right = 1.0, low_forward = 0.0, high_forward = 1.0;  ///< metres
  double step = 1.0;                                                                ///< metres

  Vector3 point(double along_right, double along_forward) const {
    return along_right * right + along_forward * forward + height * up;
  }
};
/// One metre steps, larger where that would make more than 200 lines.
GroundFrame groundFrame(const SceneContent& content);

/// The lines of the grid.
Props makeGroundGrid(const GroundFrame& frame, const Vector3& origin, bool on_dark);
/// Numbers along the two sides of the grid that face the camera, with the axes' names.
Props makeRuler(const GroundFrame& frame, const Vector3& origin, const CameraView& view,
                int picture_height, bool on_dark);
/// Small axes x, y, z of the map in the lower left corner.
Props makeCornerAxes(const CameraView& view, int picture_width, int picture_height, bool on_dark);
/// The path as a tube with an arrow, and the axes of some of its poses.
Props makeTrajectory(const SceneContent& content, const Vector3& origin);
/// An overlay cloud as points.
Props makeCloud(const SceneCloud& cloud, const Vector3& origin, double point_size);
/// The twelve edges of a cuboid, to mark it as picked.
Props makeOutline(const Cuboid& cuboid, const Vector3& origin);

}  // namespace planar_mapping::visualization
