// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkProp.h>
#include <vtkSmartPointer.h>

#include <vector>

#include "planar_mapping/core/base/types.h"
#include "planar_mapping/visualization/camera.h"
#include "planar_mapping/visualization/scene_content.h"
#include "planar_mapping/visualization/view_options.h"
#include "scene/captions.h"
#include "scene/ground.h"

namespace planar_mapping::visualization {

using Props = std::vector<vtkSmartPointer<vtkProp>>;

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
