// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/core/error.h"
#include "planar_mapping/filters/ground_removal.h"
#include "planar_mapping/pcl/points_view.h"

namespace planar_mapping {

template <typename PointT>
GroundRemoval<PointT>::GroundRemoval(bool extract_removed_indices)
    : detail::PointFilter<PointT>(extract_removed_indices) {
  this->filter_name_ = "GroundRemoval";
}

template <typename PointT>
std::vector<detail::Verdict> GroundRemoval<PointT>::judge(const PointCloud& cloud,
                                                          const Indices* indices) {
  ground_ = Ground();
  const CloudView view = viewOf(cloud);
  const PointsView& points = view;
  const Vector3 sensor = cloud.sensor_origin_.template head<3>().template cast<double>();
  ground_ = findGround(points, indices, params_, sensor);

  std::vector<detail::Verdict> verdicts(ground_.is_ground.size(), detail::Verdict::Invalid);
  for (std::size_t k = 0; k < verdicts.size(); ++k) {
    const std::size_t i = indices ? static_cast<std::size_t>((*indices)[k]) : k;
    if (!points.isFinite(i)) continue;
    verdicts[k] = ground_.is_ground[k] ? detail::Verdict::Fails : detail::Verdict::Passes;
  }
  return verdicts;
}

template <typename PointT>
void GroundRemoval<PointT>::getGroundPlane(Vector4& coefficients, Matrix4& covariance) const {
  coefficients = ground_.found ? ground_.plane.coefficients() : Vector4(Vector4::Zero());
  covariance = ground_.covariance;
}

template <typename PointT>
void GroundRemoval<PointT>::setParams(const GroundParams& params) {
  params.validate();
  params_ = params;
}

// One setter = one field changed in a copy that must still be valid.
#define PLANAR_MAPPING_SETTER(name, type, field) \
  template <typename PointT>                     \
  void GroundRemoval<PointT>::name(type value) { \
    GroundParams changed = params_;              \
    changed.field = value;                       \
    setParams(changed);                          \
  }
PLANAR_MAPPING_SETTER(setCameraHeight, double, camera_height)
PLANAR_MAPPING_SETTER(setHeightTolerance, double, height_tolerance)
PLANAR_MAPPING_SETTER(setUpAxis, const Vector3&, up)
PLANAR_MAPPING_SETTER(setOpticalAxis, const Vector3&, optical_axis)
PLANAR_MAPPING_SETTER(setPitchTolerance, double, pitch_tolerance)
PLANAR_MAPPING_SETTER(setRollTolerance, double, roll_tolerance)
PLANAR_MAPPING_SETTER(setDistanceThreshold, double, distance_threshold)
PLANAR_MAPPING_SETTER(setNoiseModel, const std::optional<StereoNoise>&, noise)
PLANAR_MAPPING_SETTER(setNoiseFactor, double, noise_factor)
PLANAR_MAPPING_SETTER(setSlopeCell, double, slope_cell)
PLANAR_MAPPING_SETTER(setMaxSlope, double, max_slope)
PLANAR_MAPPING_SETTER(setWallHeight, double, wall_height)
PLANAR_MAPPING_SETTER(setWallCell, double, wall_cell)
PLANAR_MAPPING_SETTER(setWallFootThreshold, double, wall_foot_threshold)
PLANAR_MAPPING_SETTER(setMinShare, double, min_share)
PLANAR_MAPPING_SETTER(setMinPoints, int, min_points)
PLANAR_MAPPING_SETTER(setSampleSize, int, sample_size)
PLANAR_MAPPING_SETTER(setSeed, std::uint64_t, seed)
#undef PLANAR_MAPPING_SETTER

}  // namespace planar_mapping
