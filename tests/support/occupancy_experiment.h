// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "noisy_sequence.h"
#include "planar_mapping/beliefs/kl_occupancy.h"

namespace planar_mapping::test {

/// A corridor along +y, 2 m wide and 2.5 m high, a cabinet every 5 m, left and right in turn.
inline Scene corridor(double length) {
  Scene scene;
  scene.boxes = {{{-1.0, -1.0, 0.0}, {1.0, length, 2.5}, true, true}};
  for (int i = 0; 5.0 * i + 4.0 < length; ++i) {
    const double y = 5.0 * i + 3.0;
    const double x = i % 2 == 0 ? -1.0 : 0.6;
    scene.boxes.push_back({{x, y, 0.0}, {x + 0.4, y + 0.8, 1.2}, false, true});
  }
  return scene;
}

/// A way to judge points: which features, which update, which motion reading.
struct Variant {
  const char* name;
  bool tracks;
  UpdateRule rule;
  MotionReading reading;
};
inline std::vector<Variant> variants() {
  return {
      {"none", true, UpdateRule::None, MotionReading::FeaturePosition},
      {"kl feature", true, UpdateRule::KullbackLeibler, MotionReading::FeaturePosition},
      {"kl pose", true, UpdateRule::KullbackLeibler, MotionReading::RobotPose},
      {"log-odds", true, UpdateRule::LogOdds, MotionReading::FeaturePosition},
      {"none cells", false, UpdateRule::None, MotionReading::FeaturePosition},
      {"kl cells", false, UpdateRule::KullbackLeibler, MotionReading::FeaturePosition},
      {"log-odds cells", false, UpdateRule::LogOdds, MotionReading::FeaturePosition},
  };
}

/// Key features that are followed through a sequence: points of the scene with an identity each.
class FeatureTracks {
 public:
  FeatureTracks(const Scene& scene, int count, Random& random) {
    while (static_cast<int>(points_.size()) < count) {
      const SceneBox& box =
          scene.boxes[random.below(static_cast<std::uint32_t>(scene.boxes.size()))];
      Vector3 p;
      for (int axis = 0; axis < 3; ++axis) p[axis] = random.uniform(box.low[axis], box.high[axis]);
      const auto axis = static_cast<int>(random.below(3));
      p[axis] = random.below(2) != 0 ? box.high[axis] : box.low[axis];
      points_.push_back(p);
    }
  }

  /// The features of a view, some of them matched wrongly, with what that does to the cloud: half
  /// of the wrong ones have a wrong disparity, as has the block of pixels about them, the others
  /// the track of another feature.
  std::vector<KeyFeature> see(View& view, const StereoErrors& errors, Random& random) const {
    const PinholeCamera& c = view.camera;
    const Pose to_camera = view.pose.inverse();
    std::vector<KeyFeature> features;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vector3 p = to_camera * points_[i];
      if (!(p.z() > 0.3)) continue;
      KeyFeature feature;
      feature.track = static_cast<std::int64_t>(i);
      feature.column = static_cast<float>(c.fx * p.x() / p.z() + c.cx);
      feature.row = static_cast<float>(c.fy * p.y() / p.z() + c.cy);
      const auto column = static_cast<int>(std::lround(feature.column));
      const auto row = static_cast<int>(std::lround(feature.row));
      if (column < 4 || row < 4 || column >= c.width - 4 || row >= c.height - 4) continue;
      const float* dense = &view.xyz[3 * static_cast<std::size_t>(row * c.width + column)];
      if (!(std::abs(dense[2] - p.z()) < 0.1 * p.z())) continue;  // hidden
      const double bf = errors.baseline * c.fx;
      const double measured = bf / (bf / p.z() + errors.noise_px * random.normal());
      feature.position = p / p.z() * measured;
      features.push_back(feature);
    }
    const std::size_t wrong = static_cast<std::size_t>(
        std::lround(errors.wrong_matches * static_cast<double>(features.size())));
    for (std::size_t k = 0; k < wrong; ++k) {
      const auto n = static_cast<std::uint32_t>(features.size());
      KeyFeature& feature = features[random.below(n)];
      if (k % 2 == 0) {
        std::swap(feature.track, features[random.below(n)].track);
        continue;
      }
      const double depth = random.uniform(0.6, 5.0);
      feature.position *= depth / feature.position.z();
      const auto column = static_cast<int>(std::lround(feature.column));
      const auto row = static_cast<int>(std::lround(feature.row));
      for (int r = row - 4; r <= row + 4; ++r) {
        for (int q = column - 4; q <= column + 4; ++q) {
          if (r < 0 || q < 0 || r >= c.height || q >= c.width) continue;
          float* p = &view.xyz[3 * static_cast<std::size_t>(r * c.width + q)];
          const double bf = errors.baseline * c.fx;
          const double z = bf / (bf / depth + errors.noise_px * random.normal());
          p[0] = static_cast<float>((q - c.cx) / c.fx * z);
          p[1] = static_cast<float>((r - c.cy) / c.fy * z);
          p[2] = static_cast<float>(z);
        }
      }
    }
    return features;
  }

 private:
  std::vector<Vector3> points_;
};

struct OutlierResult {
  std::size_t wrong = 0;
  std::size_t occupied = 0;
  double completeness = 0.0;
};

/// One frame of the sequence of the experiment, made once for all variants.
struct OutlierFrame {
  View view;
  std::vector<KeyFeature> features;
  std::optional<FrameMotion> motion;
};

inline std::vector<OutlierFrame> outlierFrames(double wrong_matches, int frames = 12) {
  const Scene scene;
  StereoErrors errors;
  errors.noise_px = 0.25;
  errors.flying = wrong_matches > 0.0 ? 0.3 : 0.0;
  errors.wrong_matches = wrong_matches;
  errors.pose_position = 0.003;
  errors.pose_angle = 0.0017;
  Random random(17);
  const FeatureTracks tracks(scene, 600, random);
  std::vector<OutlierFrame> all;
  Pose told_before = Pose::Identity();
  Pose true_before = Pose::Identity();
  for (int i = 0; i < frames; ++i) {
    OutlierFrame frame;
    const Pose pose = lookFrom({-0.6 + 0.1 * i, -0.4 + 0.03 * i, 1.1}, 0.05 * (i % 7) - 0.15);
    // Exact from its own place, then told a pose with a little error.
    frame.view = look(scene, pose, 0.1 * i);
    addStereoErrors(frame.view, errors, random);
    frame.features = tracks.see(frame.view, errors, random);
    findPlanesOf(frame.view, errors, 300);
    frame.view.pose = disturbed(pose, errors, random);
    if (i > 0) {
      FrameMotion motion;
      motion.T_now_before = frame.view.pose.inverse() * told_before;
      motion.predicted = pose.inverse() * true_before;
      for (int k = 0; k < 3; ++k) {
        motion.covariance(k, k) = 2.0 * errors.pose_position * errors.pose_position;
        motion.covariance(3 + k, 3 + k) = 2.0 * errors.pose_angle * errors.pose_angle;
      }
      frame.motion = motion;
    }
    told_before = frame.view.pose;
    true_before = pose;
    all.push_back(std::move(frame));
  }
  return all;
}

inline OutlierResult runOutliers(const std::vector<OutlierFrame>& frames, double miss_factor,
                                 const Variant& variant) {
  const Scene scene;
  KlOccupancyParams params;
  params.source = variant.tracks ? FeatureSource::Tracks : FeatureSource::Cells;
  params.beliefs.occupancy.noise = {0.25, scene.camera.fx, 0.5};
  params.beliefs.update.rule = variant.rule;
  params.beliefs.motion_reading = variant.reading;
  KlOccupancy occupancy(params);
  PlanarMapParams map_params;
  map_params.miss_factor = miss_factor;
  map_params.unknown_space = false;
  map_params.max_range = 8.0;
  PlanarMap map(map_params);
  std::vector<View> exact;
  for (const OutlierFrame& f : frames) {
    const std::size_t n = f.view.xyz.size() / 3;
    std::vector<std::int32_t> labels(n, -1);
    for (std::size_t k = 0; k < f.view.planes.size(); ++k) {
      for (const int i : f.view.planes[k].inliers)
        labels[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(k);
    }
    Indices indices;
    for (std::size_t i = 0; i < n; ++i) {
      if (std::isfinite(f.view.xyz[3 * i])) indices.push_back(static_cast<int>(i));
    }
    FrameObservation frame = f.view.frame();
    OccupancyFrame of;
    of.points = frame.points;
    of.indices = &indices;
    of.plane_labels = &labels;
    of.T_world_sensor = f.view.pose;
    of.key_features = &f.features;
    of.motion = f.motion;
    std::vector<float> probability;
    occupancy.update(of, probability);
    frame.probability = &probability;
    frame.noise = params.beliefs.occupancy.noise;
    map.insert(frame);
  }
  for (std::size_t i = 0; i < frames.size(); i += 3)
    exact.push_back(look(scene, frames[i].view.pose));
  const MappingError error = mappingError(map, scene, 0.1);
  return {error.wrong, error.occupied, completeness(map, exact, 0.1)};
}

inline OutlierResult runOutliers(double wrong_matches, double miss_factor, const Variant& variant) {
  return runOutliers(outlierFrames(wrong_matches), miss_factor, variant);
}

}  // namespace planar_mapping::test
