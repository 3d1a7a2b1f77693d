// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "evaluation/simulation/ray_caster.h"
#include "evaluation/simulation/scene.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/geometry/angles.h"

namespace planar_mapping::test {

/// A level scanner, x forward, y left, z up, where a camera of a simulated path is.
inline Pose scannerAt(const Pose& T_world_camera) {
  const Vector3 forward = T_world_camera.linear().col(2);
  Pose pose = Pose::Identity();
  pose.linear() =
      Eigen::AngleAxisd(std::atan2(forward.y(), forward.x()), Vector3::UnitZ()).toRotationMatrix();
  pose.translation() = T_world_camera.translation();
  return pose;
}

/// What a scanner of 24 rings up to 30 degrees off level sees of a simulated scene, x y z in its
/// frame, with a range noise of 1 cm.
inline std::vector<float> scanOf(const evaluation::Scene& scene, const Pose& T_world_sensor,
                                 int frame, Random& random) {
  constexpr int kRings = 24, kColumns = 300;
  constexpr double kSteepest = 30.0 * kRadiansPerDegree, kNoise = 0.01;
  std::vector<float> xyz;
  for (int ring = 0; ring < kRings; ++ring) {
    const double up = kSteepest * (2.0 * ring / (kRings - 1) - 1.0);
    for (int column = 0; column < kColumns; ++column) {
      const double yaw = 2.0 * M_PI * column / kColumns;
      const Vector3 ray(std::cos(up) * std::cos(yaw), std::cos(up) * std::sin(yaw), std::sin(up));
      double range = std::numeric_limits<double>::infinity();
      for (const evaluation::SceneObject& object : scene.objects) {
        double t = 0.0;
        int face = 0;
        if (object.isThere(frame) && evaluation::intersect(object, T_world_sensor.translation(),
                                                           T_world_sensor.linear() * ray, t, face))
          range = std::min(range, t);
      }
      if (!std::isfinite(range)) continue;
      const Vector3 point = (range + kNoise * random.normal()) * ray;
      for (int k = 0; k < 3; ++k) xyz.push_back(static_cast<float>(point[k]));
    }
  }
  return xyz;
}

}  // namespace planar_mapping::test
