// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/filters/kl_occupancy_filter.h"
#include "planar_mapping/pcl/parameter_setter.h"
#include "planar_mapping/pcl/points_view.h"
#include "planar_mapping/pcl/sensor_pose.h"

namespace planar_mapping {

template <typename PointT>
KLOccupancyFilter<PointT>::KLOccupancyFilter(bool extract_removed_indices)
    : detail::PointFilter<PointT>(extract_removed_indices) {
  this->filter_name_ = "KLOccupancyFilter";
}

template <typename PointT>
std::vector<std::uint8_t> KLOccupancyFilter<PointT>::test(const PointCloud& cloud,
                                                          const Indices* indices) {
  const CloudView view = viewOf(cloud);
  OccupancyFrame frame;
  frame.points = view;
  frame.indices = indices;
  // The identity is what a cloud without a pose has.
  const Pose T_world_sensor = sensorPoseOf(cloud, sensor_pose_);
  if (sensor_pose_ || !T_world_sensor.matrix().isIdentity(0.0)) {
    frame.T_world_sensor = T_world_sensor;
  }
  if (!plane_labels_.empty()) frame.plane_labels = &plane_labels_;
  if (!key_features_.empty()) frame.key_features = &key_features_;
  if (!tracks_.empty()) frame.tracks = &tracks_;
  frame.motion = motion_;
  diagnostics_ = occupancy_.update(frame, probabilities_);
  motion_.reset();

  std::vector<std::uint8_t> verdicts(indices ? indices->size() : cloud.size());
  const double limit = getMinProbability();
  for (std::size_t k = 0; k < verdicts.size(); ++k) {
    const std::size_t i = indices ? static_cast<std::size_t>((*indices)[k]) : k;
    verdicts[k] = probabilities_[i] >= limit ? detail::kPasses : detail::kFails;
  }
  if (diagnostics_.points_not_measured > 0) this->markNotMeasured(view, indices, verdicts);
  return verdicts;
}

template <typename PointT>
void KLOccupancyFilter<PointT>::setMotion(const std::optional<FrameMotion>& motion) {
  if (motion) motion->validate();
  motion_ = motion;
}

template <typename PointT>
void KLOccupancyFilter<PointT>::setMotion(const Pose& T_now_before, const Matrix6& covariance) {
  FrameMotion motion;
  motion.T_now_before = T_now_before;
  motion.covariance = covariance;
  setMotion(motion);
}

PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setFeatureSource, FeatureSource, source)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setMinProbability, double, min_probability)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setResolution, double, resolution)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setRangeFloor, double, range_floor_cells)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setNoiseModel, const StereoNoise&,
                                beliefs.occupancy.noise)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setSingleFeatureProbability, double,
                                beliefs.occupancy.single_feature_probability)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setOpticalAxis, const std::optional<Vector3>&,
                                optical_axis)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setBias, double, beliefs.update.bias)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setUpdateRule, UpdateRule, beliefs.update.rule)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setFeaturesPerCell, int, features_per_cell)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setDenseGroups, bool, dense_groups)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setDoubtSpreads, bool, doubt_spreads)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setNumberOfThreads, int, threads)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setMotionReading, MotionReading,
                                beliefs.motion_reading)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setMaxUnseenFrames, int,
                                beliefs.max_unseen_frames)

}  // namespace planar_mapping
