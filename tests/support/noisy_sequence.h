// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/geometry/camera.h"

namespace planar_mapping::test {

/// What a stereo camera does to a view of a scene.
struct StereoErrors {
  double baseline = 0.25;   ///< metres
  double noise_px = 0.0;    ///< standard deviation of the disparity
  double correlated = 0.7;  ///< fraction of its variance that blocks of 8 x 8 pixels have in common
  double flying = 0.0;      ///< fraction of the pixels at depth edges that lie between both sides
  double wrong_matches = 0.0;  ///< fraction of the features of a frame that are matched wrongly
  double pose_position = 0.0;  ///< standard deviation of the error of the pose, metres
  double pose_angle = 0.0;     ///< and of its angles, radians
};

inline Pose disturbed(const Pose& pose, const StereoErrors& errors, Random& random) {
  Pose moved = pose;
  Vector3 turn, shift;
  for (int i = 0; i < 3; ++i) {
    turn[i] = errors.pose_angle * random.normal();
    shift[i] = errors.pose_position * random.normal();
  }
  if (turn.norm() > 0.0) {
    moved.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * pose.linear();
  }
  moved.translation() += shift;
  return moved;
}

/// Puts noise on the disparities of a view and lets pixels at edges fly.
inline void addStereoErrors(View& view, const StereoErrors& errors, Random& random) {
  const int width = view.camera.width;
  const int height = view.camera.height;
  const double bf = errors.baseline * view.camera.fx;
  const int blocks = width / 8 + 1;
  std::vector<double> common(static_cast<std::size_t>(blocks) * (height / 8 + 1));
  for (double& c : common) c = random.normal();
  const std::vector<float> exact = view.xyz;
  const auto depth = [&](int row, int column) {
    return exact[3 * static_cast<std::size_t>(row * width + column) + 2];
  };
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      float* p = &view.xyz[3 * static_cast<std::size_t>(row * width + column)];
      double z = p[2];
      if (!(z > 0.0)) continue;
      if (errors.flying > 0.0 && column > 0 && row > 0) {
        for (const double other : {depth(row, column - 1), depth(row - 1, column)}) {
          if (other > 0.0 && std::abs(bf / other - bf / z) > 1.0 &&
              random.uniform(0.0, 1.0) < errors.flying) {
            const double fraction = random.uniform(0.0, 1.0);
            z = bf / (fraction * bf / other + (1.0 - fraction) * bf / z);
            break;
          }
        }
      }
      const double block = common[static_cast<std::size_t>((row / 8) * blocks + column / 8)];
      const double noise = errors.noise_px * (std::sqrt(errors.correlated) * block +
                                              std::sqrt(1.0 - errors.correlated) * random.normal());
      const double measured = bf / std::max(bf / z + noise, 1.0);
      for (int i = 0; i < 3; ++i) p[i] = static_cast<float>(p[i] / p[2] * measured);
    }
  }
}

/// Planes as the pipeline would find them.
inline void findPlanesOf(View& view, const StereoErrors& errors, int min_inliers) {
  MultiPlaneParams params;
  params.min_inliers = min_inliers;
  params.noise = StereoNoise{errors.baseline, view.camera.fx, 0.5};
  params.noise_factor = 2.0;
  view.planes =
      findPlanes(PointsView(view.xyz.data(), static_cast<std::uint32_t>(view.camera.width),
                            static_cast<std::uint32_t>(view.camera.height), 3),
                 nullptr, params)
          .planes;
}

/// A noisy view from about `pose`, which is what the map is told.
inline View lookNoisy(const Scene& scene, const Pose& pose, const StereoErrors& errors,
                      Random& random, int min_inliers, double timestamp = 0.0) {
  View view = look(scene, disturbed(pose, errors, random), timestamp);
  view.pose = pose;
  addStereoErrors(view, errors, random);
  findPlanesOf(view, errors, min_inliers);
  return view;
}

/// Distance of a point to the nearest face of the scene, metres.
inline double distanceToScene(const Scene& scene, const Vector3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const SceneBox& box : scene.boxes) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double at : {box.low[axis], box.high[axis]}) {
        Vector3 nearest = p.cwiseMax(box.low).cwiseMin(box.high);
        nearest[axis] = at;
        best = std::min(best, (p - nearest).norm());
      }
    }
  }
  return best;
}

/// Cells of a grid of side s over the scene: occupied ones farther than s from any face, and cells
/// on a face that the map has within s, among those that have to be there.
struct MappingError {
  std::size_t wrong = 0;
  std::size_t occupied = 0;
};
inline MappingError mappingError(const PlanarMap& map, const Scene& scene, double s) {
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  for (const SceneBox& box : scene.boxes) {
    low = low.cwiseMin(box.low);
    high = high.cwiseMax(box.high);
  }
  low.array() -= 5 * s;
  high.array() += 5 * s;
  MappingError error;
  for (double z = low.z(); z < high.z(); z += s) {
    for (double y = low.y(); y < high.y(); y += s) {
      for (double x = low.x(); x < high.x(); x += s) {
        // Near the middle of the cell: through the middle itself go faces of half cells.
        const Vector3 middle(x + 0.45 * s, y + 0.45 * s, z + 0.45 * s);
        if (!map.isOccupied(middle)) continue;
        ++error.occupied;
        error.wrong += distanceToScene(scene, middle) > s ? 1 : 0;
      }
    }
  }
  return error;
}
/// Fraction of exact points of views that the map has within `margin`.
inline double completeness(const PlanarMap& map, const std::vector<View>& exact, double margin) {
  std::size_t points = 0, found = 0;
  for (const View& view : exact) {
    for (std::size_t i = 0; i + 2 < view.xyz.size(); i += 3 * 53) {
      const Vector3 p(view.xyz[i], view.xyz[i + 1], view.xyz[i + 2]);
      if (!p.allFinite()) continue;
      ++points;
      found += map.cuboidsAt(view.pose * p, margin).empty() ? 0 : 1;
    }
  }
  return points == 0 ? 1.0 : static_cast<double>(found) / static_cast<double>(points);
}

/// Views through the scene from the places numbered so, half a metre and a fifth of a radian apart.
inline std::vector<View> noisyWalk(const std::vector<int>& places) {
  StereoErrors errors;
  errors.noise_px = 0.25;
  errors.flying = 0.2;
  errors.pose_position = 0.01;  // planes move a little from frame to frame
  Random random(5);
  std::vector<View> views;
  for (const int place : places) {
    const Pose pose = lookFrom({-1.2 + 0.5 * place, -0.4, 1.0}, 0.2 * place - 0.5);
    views.push_back(lookNoisy(Scene(), pose, errors, random, 300));
  }
  return views;
}

/// Frames of a room by a noisy camera: planes in all directions, boxes that lie on planes.
inline PlanarMap noisyMap(double resolution) {
  PlanarMapParams params;
  params.approximation.resolution = resolution;
  PlanarMap map(params);
  for (const View& view : noisyWalk({0, 1, 2, 3})) {
    FrameObservation frame = view.frame();
    frame.noise = StereoNoise{0.25, view.camera.fx, 0.5};
    map.insert(frame);
  }
  return map;
}

inline PlanarMapParams roomParams(double resolution = 0.1) {
  PlanarMapParams params;
  params.setResolution(resolution);
  params.max_range = 8.0;
  params.unknown_space = false;
  return params;
}

inline StereoErrors noiseOf(double px, double flying = 0.0) {
  StereoErrors errors;
  errors.noise_px = px;
  errors.flying = flying;
  return errors;
}

inline Scene roomWith(const SceneBox& box) {
  Scene scene;
  scene.boxes = {{{-2.0, -1.0, 0.0}, {2.0, 5.0, 2.6}, true, true}, box};
  return scene;
}

inline FrameObservation observationOf(const View& view, const StereoErrors& errors) {
  FrameObservation frame = view.frame();
  frame.noise = StereoNoise{errors.baseline, view.camera.fx, 0.5};
  return frame;
}

}  // namespace planar_mapping::test
