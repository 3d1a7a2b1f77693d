// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping {

/// What of a frame a keyframe is made of (makeKeyframe()).
struct KeyframeView {
  io::Image gray;
  PointsView cloud;  ///< that of the frame, which has to outlive it
  FeatureCamera camera;
};

/// Whether a frame has an image that belongs to its cloud pixel by pixel.
PLANAR_MAPPING_EXPORT bool showsItsCloud(const Frame& frame);

/// Once Images stages have made its cloud. Nothing where the image does not show the cloud.
PLANAR_MAPPING_EXPORT std::optional<KeyframeView> keyframeViewOf(const Frame& frame);

}  // namespace planar_mapping
