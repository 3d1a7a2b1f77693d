// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/core/geometry/cuboid.h"
#include "planar_mapping/core/base/export.h"
#include "planar_mapping/visualization/camera.h"
#include "planar_mapping/visualization/image.h"

namespace planar_mapping {

/// What one method marks as occupied, told apart by truth.
struct ArtefactPanel {
  std::string title;
  std::vector<Cuboid> right;  ///< drawn by height
  std::vector<Cuboid> wrong;  ///< drawn red
};

/// Erroneous artefacts of several methods beside each other, from the same place (the paper,
/// Fig. 9). All panels are of one size and share one scale of heights.
/// \param view           world frame of the cuboids
/// \param width, height  of one panel, pixels, in [160, 4096]
/// \throws RenderError if nothing here can draw; InputError without panels or with cuboids that
///         cannot be drawn; ParameterError
PLANAR_MAPPING_EXPORT Image renderArtefacts(const std::vector<ArtefactPanel>& panels,
                                            const CameraView& view, int width, int height);

}  // namespace planar_mapping
