// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/keyframe_view.h"

namespace planar_mapping {

std::optional<KeyframeView> keyframeViewOf(const Frame& frame) {
  const io::Image& left = frame.images.left;
  if (!frame.camera || left.empty() || !frame.cloud->isOrganized() ||
      left.width != static_cast<int>(frame.cloud->width) ||
      left.height != static_cast<int>(frame.cloud->height))
    return std::nullopt;
  KeyframeView view;
  view.gray = io::toGray(left);
  view.cloud = pointsOf(*frame.cloud);
  view.camera.fx = frame.camera->fx;
  view.camera.fy = frame.camera->fy;
  view.camera.cx = frame.camera->cx;
  view.camera.cy = frame.camera->cy;
  if (frame.baseline) {
    StereoNoise noise;
    noise.baseline = *frame.baseline;
    noise.focal_length = frame.camera->fx;
    view.camera.depth_error_growth = noise.depthError(1.0);
  }
  return view;
}

}  // namespace planar_mapping
