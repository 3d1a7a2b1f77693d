// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/atlas/atlas_builder.h"
#include "planar_mapping/geometry/angles.h"
#include "stereo_images.h"

namespace planar_mapping::test {

/// What a depth camera sees in the room of map_scene.h, whose walls are painted.
struct PaintedView : View {
  io::Image gray;
};

/// \param paint  rooms of other numbers have the same walls, painted otherwise
inline PaintedView lookAtPaint(const Pose& T_world_camera, std::uint64_t paint) {
  const Scene scene;
  PaintedView view;
  static_cast<View&>(view) = look(scene, T_world_camera);
  const PinholeCamera& c = scene.camera;
  view.gray = planar_mapping::paint(c.width, c.height, [&](int column, int row) {
    const Vector3 ray((column - c.cx) / c.fx, (row - c.cy) / c.fy, 1.0);
    const Vector3 along = T_world_camera.linear() * ray;
    const SceneHit hit = castRay(scene, T_world_camera.translation(), along);
    if (hit.face < 0) return 0.0;
    const Vector3 point = T_world_camera.translation() + hit.t * along;
    const int axis = hit.face / 2 % 3;
    return wallTone(point[(axis + 1) % 3], point[(axis + 2) % 3], 0.0,
                    100 * paint + static_cast<std::uint64_t>(hit.face));
  });
  return view;
}

/// From the middle of the room to all sides, a full turn of \p all frames, and on.
inline Pose aroundRoom(int frame, int all) {
  const double yaw = 2.0 * M_PI * frame / all;
  return lookFrom({-0.3 * std::sin(yaw), 1.3 + 0.3 * std::cos(yaw), 1.2}, yaw);
}

inline AtlasBuilder::Update addView(AtlasBuilder& builder, std::size_t number,
                                    const PaintedView& view, const Pose& T_track_sensor,
                                    bool with_image = true, std::size_t track = 0) {
  FrameObservation observation = view.frame();
  observation.T_world_sensor = T_track_sensor;
  observation.timestamp = static_cast<double>(number);
  builder.mapForNext(track).insert(observation);
  AtlasBuilder::Seen seen;
  seen.frame = number;
  seen.source = "rgb/" + std::to_string(number) + ".png";
  seen.timestamp = observation.timestamp;
  seen.T_track_sensor = T_track_sensor;
  if (with_image) seen.gray = &view.gray;
  seen.cloud = observation.points;
  seen.camera.setPinhole(view.camera);
  return builder.add(seen);
}

inline PlanarMapParams paintedMapParams() {
  PlanarMapParams params;
  params.approximation.resolution = 0.1;
  return params;
}

}  // namespace planar_mapping::test
