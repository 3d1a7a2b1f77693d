// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/filters/kl_occupancy_filter.h"
#include "planar_mapping/pcl/parameter_setter.h"
#include "planar_mapping/pcl/points_view.h"

namespace planar_mapping {

template <typename PointT>
KLOccupancyFilter<PointT>::KLOccupancyFilter(bool extract_removed_indices)
    : detail::PointFilter<PointT>(extract_removed_indices) {
  this->filter_name_ = "KLOccupancyFilter";
}

template <typename PointT>
std::vector<detail::Verdict> KLOccupancyFilter<PointT>::judge(const PointCloud& cloud,
                                                              const Indices* indices) {
  probabilities_.clear();
  diagnostics_ = KlOccupancyDiagnostics();
  const CloudView view = viewOf(cloud);
  OccupancyFrame frame;
  frame.points = view;
  frame.sensor = cloud.sensor_origin_.template head<3>().template cast<double>();
  frame.indices = indices;
  if (!tracks_.empty()) frame.tracks = &tracks_;
  if (!plane_labels_.empty()) frame.plane_labels = &plane_labels_;
  if (!groups_.empty()) frame.groups = &groups_;
  frame.motion = motion_;
  const std::vector<float> beliefs = occupancy_.process(frame, &diagnostics_);
  motion_.reset();

  probabilities_.assign(cloud.size(), std::numeric_limits<float>::quiet_NaN());
  std::vector<detail::Verdict> verdicts(beliefs.size(), detail::Verdict::Invalid);
  for (std::size_t k = 0; k < beliefs.size(); ++k) {
    const std::size_t i = indices ? static_cast<std::size_t>((*indices)[k]) : k;
    probabilities_[i] = beliefs[k];
    if (!frame.points.isFinite(i)) continue;
    verdicts[k] =
        beliefs[k] >= getMinProbability() ? detail::Verdict::Passes : detail::Verdict::Fails;
  }
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

PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setMinProbability, double, min_probability)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setResolution, double, resolution)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setRangeFloor, double, range_floor_cells)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setNoiseModel, const StereoNoise&,
                                beliefs.occupancy.noise)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setSingleFeatureProbability, double,
                                beliefs.occupancy.single_feature_probability)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setOpticalAxis, const Vector3&,
                                beliefs.occupancy.optical_axis)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setBias, double, beliefs.update.bias)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setMotionReading, MotionReading,
                                beliefs.motion_reading)
PLANAR_MAPPING_PARAMETER_SETTER(KLOccupancyFilter, setMaxUnseenFrames, int,
                                beliefs.max_unseen_frames)

}  // namespace planar_mapping
