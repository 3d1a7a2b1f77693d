// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstring>
#include <limits>

#include "planar_mapping/base/random.h"
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping {

/// A wall before a camera, with holes, as a front-end leaves it: depth noise of a millimetre, x and
/// y from the unrounded depth.
inline Frame transportFrame(std::uint32_t width, std::uint32_t height, std::uint64_t seed = 1) {
  Random random(seed);
  Frame frame;
  frame.number = 3 * seed;
  frame.source = "left/" + std::to_string(seed) + ".png";
  frame.timestamp = 0.1 * static_cast<double>(seed);
  frame.camera =
      PinholeCamera{0.8 * width + 1.0,   0.8 * width + 1.0,       0.5 * width - 0.25,
                    0.5 * height + 0.25, static_cast<int>(width), static_cast<int>(height)};
  frame.baseline = 0.12;
  frame.pose_assumed = seed % 2 != 0;
  frame.without_sensor = seed % 3 != 0;
  Pose pose = Pose::Identity();
  pose.linear() = Quaternion(0.9, 0.1, -0.2, 0.3).normalized().toRotationMatrix();
  pose.translation() = Vector3(1.5, -2.5, 0.37);
  frame.given_pose = pose;
  frame.T_world_sensor = pose;
  frame.cloud = pcl::make_shared<FrameCloud>();
  frame.cloud->width = width;
  frame.cloud->height = height;
  frame.cloud->is_dense = false;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (std::uint32_t row = 0; row < height; ++row) {
    for (std::uint32_t column = 0; column < width; ++column) {
      if (random.uniform() < 0.1) {
        frame.cloud->points.emplace_back(nan, nan, nan);
        continue;
      }
      const double z = 2.0 + 0.001 * column + 0.001 * random.normal();
      frame.cloud->points.emplace_back(
          static_cast<float>((column - frame.camera->cx) / frame.camera->fx * z),
          static_cast<float>((row - frame.camera->cy) / frame.camera->fy * z),
          static_cast<float>(z));
    }
  }
  for (int i = 0; i < 5; ++i) {
    KeyFeature feature;
    feature.track = 100 + i;
    feature.sightings = i + 1;
    feature.column = static_cast<float>(i) + 0.25F;
    feature.row = static_cast<float>(i) + 0.75F;
    feature.position = Vector3(0.1 * i, -0.2 * i, 2.0 + 1.0 / 3.0);
    frame.key_features.push_back(feature);
  }
  frame.points_input = frame.cloud->size();
  frame.features = 5;
  frame.matches = 4;
  frame.statistics = {{"disparity_fraction", 0.75}, {"stereo_ms", 12.5}};
  frame.stage_ms = {12.5, 0.0, 3.25};
  frame.notes = {"a note"};
  frame.warnings = {"a warning", "another"};
  return frame;
}

/// A limit that holds for all of them.
constexpr std::size_t kManyBytes = 10000000;

/// Equal bit by bit; three NaN stand for each point that is not finite.
inline bool sameCloud(const FrameCloud& sent, const FrameCloud& received) {
  if (sent.width != received.width || sent.height != received.height ||
      sent.size() != received.size() || sent.is_dense != received.is_dense) {
    return false;
  }
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const pcl::PointXYZ& a = sent.points[i];
    const pcl::PointXYZ& b = received.points[i];
    if (std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z)) {
      if (std::memcmp(a.data, b.data, 3 * sizeof(float)) != 0) return false;
    } else if (!std::isnan(b.x) || !std::isnan(b.y) || !std::isnan(b.z)) {
      return false;
    }
  }
  return true;
}

}  // namespace planar_mapping
