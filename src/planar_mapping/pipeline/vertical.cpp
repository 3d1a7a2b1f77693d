// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/vertical.h"

#include "planar_mapping/pipeline/rounded.h"

namespace planar_mapping::detail {

void findVertical(const std::optional<ImagesUp>& images, CloudScale& scale, Frame& frame) {
  if (!scale.has_sensor) return;
  if (frame.starts_world) {
    // Made level, but for `start: identity`.
    if (!frame.T_world_sensor.linear().isIdentity(0.0)) scale.up = Vector3::UnitZ();
    return;
  }
  if (!scale.optical || !frame.given_pose) return;
  const std::vector<PlaneSegment> planes =
      frame.camera ? planesFor(pointsOf(*frame.cloud), scale.stereo) : std::vector<PlaneSegment>();
  const WorldUp found = upOf(scale.up, images, frame.T_world_sensor, planes);
  scale.up = found.up;
  const std::string chosen = frame.source + ": upwards in the world of the given poses is " +
                             rounded(found.up, 3) + (found.is_leaning ? " by the planes seen" : "");
  if (found.is_uncertain) {
    frame.warnings.push_back(chosen +
                             ", if what looks like a floor or a wall is one; else give --up x, y "
                             "or z");
  } else if (found.up != Vector3::UnitZ()) {
    frame.notes.push_back(chosen);
  }
}

}  // namespace planar_mapping::detail
