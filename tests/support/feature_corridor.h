// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping::test {

/// A camera with the depth error of the paper (III-D), dz = z^2 / (B f) * dd.
inline FeatureCamera stereoCamera(double fx, double fy, double cx, double cy, double baseline,
                                  double disparity_error = 0.5) {
  FeatureCamera camera;
  camera.fx = fx;
  camera.fy = fy;
  camera.cx = cx;
  camera.cy = cy;
  camera.depth_error_growth = disparity_error / (baseline * fx);
  return camera;
}

/// Landmarks on the walls of a corridor along x, and a camera that looks along it.
class FeatureCorridor {
 public:
  explicit FeatureCorridor(std::uint64_t seed = 1) : random_(seed) {
    for (int i = 0; i < 3000; ++i) {
      const double x = random_.uniform(0.0, 40.0);
      const double side = random_.uniform(0.0, 3.0);
      if (side < 1.0) {
        points_.emplace_back(x, 1.2, random_.uniform(0.0, 2.2));
      } else if (side < 2.0) {
        points_.emplace_back(x, -1.2, random_.uniform(0.0, 2.2));
      } else {
        points_.emplace_back(x, random_.uniform(-1.2, 1.2), 2.2);
      }
    }
  }

  static FeatureCamera camera() {
    FeatureCamera camera = stereoCamera(500.0, 500.0, 320.0, 240.0, 0.12, 0.3);
    camera.pixel_error = 0.3;
    return camera;
  }

  static Pose poseAt(double x, double y = 0.0, double yaw = 0.0) {
    Pose pose = Pose::Identity();
    Matrix3 axes;  // optical axes, looking along x
    axes << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
    pose.linear() = Eigen::AngleAxisd(yaw, Vector3::UnitZ()).toRotationMatrix() * axes;
    pose.translation() << x, y, 0.9;
    return pose;
  }

  /// What the camera sees from there: the nearest 200 points in view, with noise.
  std::vector<KeyFeature> see(const Pose& T_world_sensor, double noise = 1.0) {
    const FeatureCamera model = camera();
    std::vector<std::pair<double, KeyFeature>> seen;
    const Pose T_sensor_world = T_world_sensor.inverse();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vector3 p = T_sensor_world * points_[i];
      if (p.z() < 0.5 || p.z() > 12.0) continue;
      FeatureSighting s = project(model, p);
      if (s.column < 0.0 || s.column > 639.0 || s.row < 0.0 || s.row > 479.0) continue;
      const Vector3 deviation = sightingVariance(model, s.inverse_depth).cwiseSqrt();
      s.column += noise * deviation.x() * random_.normal();
      s.row += noise * deviation.y() * random_.normal();
      s.inverse_depth += noise * deviation.z() * random_.normal();
      KeyFeature feature;
      feature.track = static_cast<std::int64_t>(i);
      feature.column = static_cast<float>(s.column);
      feature.row = static_cast<float>(s.row);
      feature.position = backProject(model, s);
      seen.push_back({p.z(), feature});
    }
    std::sort(seen.begin(), seen.end(),
              [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<KeyFeature> features;
    for (std::size_t i = 0; i < std::min<std::size_t>(200, seen.size()); ++i)
      features.push_back(seen[i].second);
    return features;
  }

  /// Gives a fraction of the features the track of another one.
  void confuse(std::vector<KeyFeature>& features, double fraction) {
    for (KeyFeature& feature : features) {
      if (random_.uniform() >= fraction) continue;
      const auto other = random_.below(static_cast<std::uint32_t>(features.size()));
      std::swap(feature.track, features[other].track);
    }
  }

 private:
  Random random_;
  std::vector<Vector3> points_;
};

/// Metres.
inline double positionError(const Pose& a, const Pose& b) {
  return (a.translation() - b.translation()).norm();
}

}  // namespace planar_mapping::test
