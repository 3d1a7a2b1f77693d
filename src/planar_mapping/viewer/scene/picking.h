// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "planar_mapping/base/export.h"
#include "planar_mapping/viewer/scene/camera.h"
#include "planar_mapping/viewer/scene/scene_content.h"

namespace planar_mapping {

/// A half line in the map's frame.
struct Ray {
  Vector3 origin = Vector3::Zero();
  Vector3 direction = Vector3::UnitX();  ///< any length but 0
};

/// The line of sight through a pixel; x, y in pixels from the top left corner, pixel centres at
/// +0.5.
PLANAR_MAPPING_EXPORT Ray sightLine(const CameraView& camera, int width, int height, double x,
                                    double y);

/// The distance along the ray (in lengths of its direction) at which it enters the cuboid, 0 when
/// it starts inside; negative if it misses.
PLANAR_MAPPING_EXPORT double enters(const Ray& ray, const Cuboid& cuboid);

/// Is the cuboid left out of a picture by cutaway or clip_above (view_options.h)?
PLANAR_MAPPING_EXPORT bool isCutAway(const Cuboid& cuboid, const CameraView& camera,
                                     const ViewOptions& options, const Vector3& up);

/// Index into content.cuboids of the first visible one that the ray meets, -1 if it meets none.
/// Cost: one box test per cuboid.
PLANAR_MAPPING_EXPORT int pickCuboid(const SceneContent& content, const Ray& ray,
                                     const CameraView& camera, const ViewOptions& options);

/// What the window shows of a picked cuboid: number, plane, centre, size, tilt, probability,
/// state; several lines.
PLANAR_MAPPING_EXPORT std::string describeCuboid(const SceneContent& content, int index);

}  // namespace planar_mapping
