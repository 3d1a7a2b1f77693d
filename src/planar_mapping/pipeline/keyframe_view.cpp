// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/keyframe_view.h"

namespace planar_mapping {

bool showsItsCloud(const Frame& frame) {
  const io::Image& left = frame.images.left;
  return frame.camera && !left.empty() && frame.cloud && frame.cloud->isOrganized() &&
         left.width == static_cast<int>(frame.cloud->width) &&
         left.height == static_cast<int>(frame.cloud->height);
}

std::optional<KeyframeView> keyframeViewOf(const Frame& frame) {
  if (!showsItsCloud(frame)) return std::nullopt;
  KeyframeView view;
  view.gray = io::toGray(frame.images.left);
  view.cloud = pointsOf(*frame.cloud);
  view.camera.setPinhole(*frame.camera);
  if (frame.baseline) {
    StereoNoise noise;
    noise.baseline = *frame.baseline;
    noise.focal_length = frame.camera->fx;
    view.camera.depth_error_growth = noise.depthError(1.0);
  }
  return view;
}

}  // namespace planar_mapping
