// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "colour_alignment.h"

#include <string>

namespace planar_mapping::detail {

bool showsTheCloud(const Frame& frame) {
  return !frame.images.left.empty() && !frame.cloud->empty() &&
         static_cast<int>(frame.cloud->width) == frame.images.left.width &&
         static_cast<int>(frame.cloud->height) == frame.images.left.height;
}

bool alignColour(FeatureKeys::Registered registered, ColourRegistration& registration,
                 Frame& frame) {
  using Registered = FeatureKeys::Registered;
  using State = ColourRegistration::State;
  if (registered == Registered::Yes || frame.images.left.empty()) return false;
  if (registered == Registered::No) {
    frame.images.left = io::Image();
    return false;
  }
  if (registration.state() == State::Unknown && showsTheCloud(frame)) {
    registration.look(frame.images.left, viewOf(*frame.cloud));
    if (registration.state() == State::Apart) {
      frame.images_changed = true;
      frame.warnings.push_back(
          "frame " + std::to_string(frame.number) + " " + frame.source +
          ": the colour images are not registered to the depth images: their edges meet where the "
          "colour image is " +
          registration.describe() +
          ", which is done from here on and right to a few pixels; better register them; "
          "key_features.registered=false leaves them out, true takes them as they are");
    }
  }
  frame.image_doubtful = registration.isDoubtful();
  frame.statistics.push_back(
      {"colour_registered", registration.state() == State::Registered ? 1.0 : 0.0});
  if (registration.state() == State::Apart)
    frame.images.left = registration.aligned(frame.images.left);
  return frame.images_changed;
}

}  // namespace planar_mapping::detail
