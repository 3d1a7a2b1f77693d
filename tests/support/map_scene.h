// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping::test {

/// An axis-aligned box seen from outside, or a room seen from inside.
struct SceneBox {
  Vector3 low;
  Vector3 high;
  bool inside_out = false;
  bool planar = true;  ///< its faces are handed over as planes
};

/// A pinhole camera in a room 4 m x 6 m x 2.6 m with two boxes in it, and a ball of clutter made
/// of a box whose faces are nobody's planes. Everything is known exactly.
struct Scene {
  std::vector<SceneBox> boxes{
      {{-2.0, -1.0, 0.0}, {2.0, 5.0, 2.6}, true, true},
      {{-1.23, 2.04, 0.0}, {-0.31, 2.96, 0.83}, false, true},
      {{0.62, 3.05, 0.0}, {1.17, 3.57, 1.52}, false, true},
      {{0.12, 1.71, 0.0}, {0.44, 2.03, 0.27}, false, false},
  };
  PinholeCamera camera{250.0, 250.0, 159.5, 119.5, 320, 240};
};

/// A camera at `position` that looks along `yaw` (0 = +y), tilted down by `pitch`.
inline Pose lookFrom(const Vector3& position, double yaw = 0.0, double pitch = 0.2) {
  const Vector3 forward(-std::sin(yaw) * std::cos(pitch), std::cos(yaw) * std::cos(pitch),
                        -std::sin(pitch));
  const Vector3 right = forward.cross(Vector3::UnitZ()).normalized();
  Matrix3 axes;
  axes << right, forward.cross(right), forward;
  Pose pose = Pose::Identity();
  pose.linear() = axes;
  pose.translation() = position;
  return pose;
}

/// What the camera sees: an organized cloud in its own frame, and the planes in it.
struct View {
  std::vector<float> xyz;
  std::vector<PlaneSegment> planes;
  Pose pose;
  PinholeCamera camera;
  double timestamp = 0.0;

  FrameObservation frame() const {
    FrameObservation frame;
    frame.T_world_sensor = pose;
    frame.timestamp = timestamp;
    frame.points = PointsView(xyz.data(), static_cast<std::uint32_t>(camera.width),
                              static_cast<std::uint32_t>(camera.height), 3);
    frame.planes = &planes;
    frame.camera = camera;
    return frame;
  }
};

/// Where a ray first meets the scene.
struct SceneHit {
  double t = std::numeric_limits<double>::infinity();
  int face = -1;  ///< 6 box + 2 axis + side
  Vector3 normal = Vector3::Zero();
};

inline SceneHit castRay(const Scene& scene, const Vector3& from, const Vector3& along) {
  SceneHit best;
  for (std::size_t k = 0; k < scene.boxes.size(); ++k) {
    const SceneBox& box = scene.boxes[k];
    for (int axis = 0; axis < 3; ++axis) {
      for (int side = 0; side < 2; ++side) {
        if (along[axis] == 0.0) continue;
        const double t = ((side != 0 ? box.high : box.low)[axis] - from[axis]) / along[axis];
        if (!(t > 1e-6 && t < best.t)) continue;
        const Vector3 p = from + t * along;
        bool within = true;
        for (int other = 0; other < 3; ++other) {
          if (other == axis) continue;
          within &= p[other] >= box.low[other] && p[other] <= box.high[other];
        }
        Vector3 normal = Vector3::Zero();
        normal[axis] = (side != 0 ? 1.0 : -1.0) * (box.inside_out ? -1.0 : 1.0);
        if (!within || normal.dot(along) >= 0.0) continue;
        best = {t, static_cast<int>(6 * k) + 2 * axis + side, normal};
      }
    }
  }
  return best;
}

inline View look(const Scene& scene, const Pose& pose, double timestamp = 0.0) {
  View view;
  view.pose = pose;
  view.camera = scene.camera;
  view.timestamp = timestamp;
  const PinholeCamera& c = scene.camera;
  std::vector<int> segment_of_face(6 * scene.boxes.size(), -1);
  const Pose to_camera = pose.inverse();
  for (int row = 0; row < c.height; ++row) {
    for (int column = 0; column < c.width; ++column) {
      const Vector3 ray((column - c.cx) / c.fx, (row - c.cy) / c.fy, 1.0);
      const SceneHit hit = castRay(scene, pose.translation(), pose.linear() * ray);
      const int index = row * c.width + column;
      if (hit.face < 0) {
        view.xyz.insert(view.xyz.end(), 3, std::numeric_limits<float>::quiet_NaN());
        continue;
      }
      for (int i = 0; i < 3; ++i) view.xyz.push_back(static_cast<float>(hit.t * ray[i]));
      if (!scene.boxes[static_cast<std::size_t>(hit.face / 6)].planar) continue;
      int& segment = segment_of_face[static_cast<std::size_t>(hit.face)];
      if (segment < 0) {
        segment = static_cast<int>(view.planes.size());
        PlaneSegment fresh;
        const Vector3 point = pose.translation() + hit.t * (pose.linear() * ray);
        fresh.plane = transformed(Plane{hit.normal, -hit.normal.dot(point)}, to_camera);
        view.planes.push_back(fresh);
      }
      PlaneSegment& plane = view.planes[static_cast<std::size_t>(segment)];
      plane.inliers.push_back(index);
      plane.moments.add(hit.t * ray);
    }
  }
  return view;
}

/// Some frames of the scene, each 0.2 m and 0.1 rad from the last one.
inline PlanarMap mapOfFrames(int frames, Profile profile = Profile::Compact,
                             double resolution = 0.1) {
  PlanarMapParams params;
  params.approximation.profile = profile;
  params.approximation.resolution = resolution;
  PlanarMap map(params);
  for (int i = 0; i < frames; ++i)
    map.insert(look(Scene(), lookFrom({-0.2 + 0.2 * i, 0.0, 1.0}, 0.1 * i), i).frame());
  return map;
}

}  // namespace planar_mapping::test
