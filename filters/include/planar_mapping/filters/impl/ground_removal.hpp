// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/filters/ground_removal.h"
#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/pcl/parameter_setter.h"
#include "planar_mapping/pcl/points_view.h"
#include "planar_mapping/pcl/sensor_pose.h"

namespace planar_mapping {

template <typename PointT>
GroundRemoval<PointT>::GroundRemoval(bool extract_removed_indices)
    : detail::PointFilter<PointT>(extract_removed_indices) {
  this->filter_name_ = "GroundRemoval";
}

template <typename PointT>
std::vector<std::uint8_t> GroundRemoval<PointT>::test(const PointCloud& cloud,
                                                      const Indices* indices) {
  ground_ = Ground();
  const CloudView view = viewOf(cloud);
  // Without the noise of a camera, whose errors far away may be metres.
  if (!getNoiseModel())
    requireMetres(view, indices, kMaxSpacingInThresholds * getDistanceThreshold(),
                  "distance_threshold");
  ground_ = tracker_.update(view, indices, sensorPoseOf(cloud, sensor_pose_));
  std::vector<std::uint8_t> verdicts = ground_.is_ground;
  static_assert(detail::kPasses == 0 && detail::kFails == 1, "as Ground::is_ground");
  if (ground_.diagnostics.points_not_measured > 0) this->markNotMeasured(view, indices, verdicts);
  return verdicts;
}

template <typename PointT>
void GroundRemoval<PointT>::getGroundPlane(Vector4& coefficients, Matrix4& covariance) const {
  coefficients = ground_.found ? ground_.plane.coefficients() : Vector4(Vector4::Zero());
  covariance = ground_.covariance;
}

PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setCameraHeight, const std::optional<double>&,
                                camera_height)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setHeightTolerance, double, height_tolerance)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setUpAxis, const std::optional<Vector3>&, up)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setOpticalAxis, const Vector3&, optical_axis)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setPitchTolerance, double, pitch_tolerance)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setRollTolerance, double, roll_tolerance)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setDistanceThreshold, double, distance_threshold)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setNoiseModel, const std::optional<StereoNoise>&,
                                noise)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setNoiseFactor, double, noise_factor)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setSlopeCell, double, slope_cell)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setMaxSlope, double, max_slope)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setWallHeight, double, wall_height)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setWallCell, double, wall_cell)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setWallFootThreshold, double, wall_foot_threshold)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setMinFraction, double, min_fraction)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setMinPoints, int, min_points)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setSampleSize, int, sample_size)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setNumberOfThreads, int, threads)
PLANAR_MAPPING_PARAMETER_SETTER(GroundRemoval, setSeed, std::uint64_t, seed)

}  // namespace planar_mapping
