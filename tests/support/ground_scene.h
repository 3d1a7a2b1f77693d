// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping::test {

/// What a camera over a ground sees: an organized cloud in its optical frame (x right, y down, z
/// forward) or in a robot's frame (x forward, y left, z up), both with the sensor at the origin.
struct GroundScene {
  /// Height of the ground at (x forward, y left), metres, relative to the foot of the sensor.
  std::function<double(double, double)> ground = [](double, double) { return 0.0; };
  /// A wall across the path, from the ground up to `wall_top`; none if not finite.
  double wall_distance = std::numeric_limits<double>::infinity();
  double wall_top = 2.0;
  double camera_height = 0.37;
  double pitch = 0.0;  ///< nose down, radians
  double roll = 0.0;
  double disparity_noise = 0.0;  ///< px, with B = 0.12 m
  double max_range = 8.0;
  double focal = 225.0;  ///< px
  int width = 240;
  int height = 180;
  std::uint64_t seed = 1;

  static constexpr double kBaseline = 0.12;

  std::vector<float> xyz;           ///< optical frame
  std::vector<std::uint8_t> truth;  ///< 1 = ground, 2 = wall, 0 = nothing

  PointsView view() const {
    return {xyz.data(), static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), 3};
  }
  /// Camera to level ground frame: x forward, y left, z up, sensor at the origin.
  Matrix3 levelFromCamera() const {
    Matrix3 axes;
    axes << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    return Eigen::AngleAxisd(pitch, Vector3::UnitY()).toRotationMatrix() *
           Eigen::AngleAxisd(roll, Vector3::UnitX()).toRotationMatrix() * axes;
  }

  GroundScene& render() {
    Random random(seed, 99);
    const Matrix3 R = levelFromCamera();
    xyz.clear();
    truth.clear();
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        const Vector3 ray((column - 0.5 * width) / focal, (row - 0.5 * height) / focal, 1.0);
        const Vector3 level = R * ray;
        int what = 0;
        double z = depthAlong(level, what);
        if (what != 0 && disparity_noise > 0.0) {
          z = kBaseline * focal / (kBaseline * focal / z + disparity_noise * random.normal());
        }
        const double nan = std::numeric_limits<double>::quiet_NaN();
        for (int k = 0; k < 3; ++k) xyz.push_back(static_cast<float>(what ? z * ray[k] : nan));
        truth.push_back(static_cast<std::uint8_t>(what));
      }
    }
    return *this;
  }

  /// The same points with z up.
  std::vector<float> robotFrame() const {
    const Matrix3 R = levelFromCamera();
    std::vector<float> turned;
    for (std::size_t i = 0; i < xyz.size(); i += 3) {
      const Vector3 p = R * Vector3(xyz[i], xyz[i + 1], xyz[i + 2]);
      for (int k = 0; k < 3; ++k) turned.push_back(static_cast<float>(p[k]));
    }
    return turned;
  }

  double fraction(const std::vector<std::uint8_t>& is_ground, int what) const {
    std::size_t all = 0;
    std::size_t marked = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (truth[i] != what) continue;
      ++all;
      marked += is_ground[i];
    }
    return all > 0 ? static_cast<double>(marked) / static_cast<double>(all) : 0.0;
  }

 private:
  double depthAlong(const Vector3& ray, int& what) const {
    // March until the ray is under the ground or behind the wall, then halve the step.
    double from = 0.0;
    const double step = 0.04;
    for (double t = step; t * ray.norm() < max_range; t += step) {
      const int hit = hitAt(t * ray);
      if (hit == 0) {
        from = t;
        continue;
      }
      double to = t;
      for (int i = 0; i < 30; ++i) {
        const double middle = 0.5 * (from + to);
        (hitAt(middle * ray) ? to : from) = middle;
      }
      what = hitAt(to * ray);
      return to;
    }
    return 0.0;
  }
  int hitAt(const Vector3& p) const {
    const double z = p.z() + camera_height;
    if (z <= ground(p.x(), p.y())) return 1;
    return p.x() >= wall_distance && z <= wall_top ? 2 : 0;
  }
};

}  // namespace planar_mapping::test
