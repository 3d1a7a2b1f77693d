// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"

/// Images and depths of a wall with a step, in squares of random gray values.
namespace planar_mapping::textured_wall {

constexpr int kWidth = 640;
constexpr int kHeight = 480;

inline FeatureCamera camera() {
  FeatureCamera camera;
  camera.depth_error = 0.005;
  camera.depth_error_growth = 0.003;
  return camera;
}

inline Pose placed(const Vector3& position, const Vector3& turn) {
  Vector6 step;
  step << position, turn;
  return motionStep(step);
}

/// Gray values that depend on the place: squares of random tone.
inline std::uint8_t toneAt(double x, double y, std::uint64_t seed) {
  const auto cell = [&](double side) {
    const auto column = static_cast<std::int64_t>(std::floor(x / side));
    const auto row = static_cast<std::int64_t>(std::floor(y / side));
    Random random(seed * 7919 + static_cast<std::uint64_t>(column * 73856093 + row * 19349663));
    random.next();
    return random.uniform();
  };
  return static_cast<std::uint8_t>(255.0 *
                                   (0.5 * cell(0.31) + 0.3 * cell(0.13) + 0.2 * cell(0.07)));
}

struct View {
  io::Image gray{kWidth, kHeight, 1, std::vector<std::uint8_t>(kWidth* kHeight)};
  std::vector<float> xyz = std::vector<float>(3 * kWidth * kHeight);
  PointsView cloud() const { return PointsView(xyz.data(), kWidth, kHeight, 3); }
};

/// A wall at 3 m with a step of one metre towards the camera, seen from a place.
inline View viewFrom(const Pose& T_world_camera, std::uint64_t seed) {
  View view;
  const Pose T_camera_world = T_world_camera.inverse();
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      const Vector3 ray = T_world_camera.linear() * Vector3((column - camera().cx) / camera().fx,
                                                            (row - camera().cy) / camera().fy, 1.0);
      const Vector3 from = T_world_camera.translation();
      Vector3 point = from + ray * ((2.0 - from.z()) / ray.z());
      if (point.x() > 0.2) point = from + ray * ((3.0 - from.z()) / ray.z());
      const auto i = static_cast<std::size_t>(row * kWidth + column);
      view.gray.pixels[i] = toneAt(point.x() + point.z(), point.y(), seed);
      Eigen::Map<Eigen::Vector3f>(view.xyz.data() + 3 * i) = (T_camera_world * point).cast<float>();
    }
  }
  return view;
}

}  // namespace planar_mapping::textured_wall
