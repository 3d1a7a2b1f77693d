// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/memory.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/ground/ground.h"
#include "planar_mapping/filters/detail/point_filter.h"

namespace planar_mapping {

/// Removes the ground of a frame (the paper, III-F, assumption 2): a plane below the sensor, found
/// anew in every frame with the camera's height and the up axis as prior, followed along slopes.
/// Steps, kerbs and the feet of walls stay.
///
/// filter() returns what stands on the ground; with setNegative(true) the ground itself, which
/// still has to clear free space. Where no ground is found nothing is removed, and
/// getDiagnostics() says why. Height is counted from the cloud's sensor_origin_. Defaults suit a
/// camera's optical frame (y down); call setUpAxis(Vector3::UnitZ()) for clouds with z up.
/// Example: examples/ground_removal.cpp.
///
/// No state between runs. One object serves one thread at a time; copies are independent.
/// filter() throws InputError for an index outside the cloud.
/// A user-defined PointT has to be registered (POINT_CLOUD_REGISTER_POINT_STRUCT), because PCL's
/// filters copy points by field; PCL_NO_PRECOMPILE is not needed.
template <typename PointT>
class PLANAR_MAPPING_EXPORT GroundRemoval : public detail::PointFilter<PointT> {
 public:
  using Ptr = pcl::shared_ptr<GroundRemoval<PointT>>;
  using ConstPtr = pcl::shared_ptr<const GroundRemoval<PointT>>;
  using PointCloud = typename pcl::FilterIndices<PointT>::PointCloud;
  using PointCloudPtr = typename PointCloud::Ptr;
  using PointCloudConstPtr = typename PointCloud::ConstPtr;

  /// \param extract_removed_indices true: getRemovedIndices() lists what was removed
  explicit GroundRemoval(bool extract_removed_indices = false);

  // Results of the last filter().

  /// The ground at the sensor: plane (normal upwards), covariance, residual, height, found or not.
  const Ground& getGround() const { return ground_; }
  /// Its coefficients a, b, c, d and their covariance; both zero where no ground was found.
  void getGroundPlane(Vector4& coefficients, Matrix4& covariance) const;
  const GroundDiagnostics& getDiagnostics() const { return ground_.diagnostics; }

  // Parameters. Every setter throws ParameterError, and changes nothing, if the value is out of
  // range; units and ranges as in GroundParams.

  void setParams(const GroundParams& params);
  const GroundParams& getParams() const { return params_; }
  /// Height of the sensor over the ground, metres; 0 = unknown.
  void setCameraHeight(double metres);
  double getCameraHeight() const { return params_.camera_height; }
  void setHeightTolerance(double metres);
  double getHeightTolerance() const { return params_.height_tolerance; }
  /// Upwards in the cloud's frame; any length but zero.
  void setUpAxis(const Vector3& up);
  const Vector3& getUpAxis() const { return params_.up; }
  /// Where the camera looks, in the cloud's frame; any length but zero.
  void setOpticalAxis(const Vector3& axis);
  const Vector3& getOpticalAxis() const { return params_.optical_axis; }
  void setPitchTolerance(double radians);
  double getPitchTolerance() const { return params_.pitch_tolerance; }
  void setRollTolerance(double radians);
  double getRollTolerance() const { return params_.roll_tolerance; }
  void setDistanceThreshold(double metres);
  double getDistanceThreshold() const { return params_.distance_threshold; }
  /// The threshold follows the stereo noise; absent = it does not.
  void setNoiseModel(const std::optional<StereoNoise>& noise);
  const std::optional<StereoNoise>& getNoiseModel() const { return params_.noise; }
  void setNoiseFactor(double factor);
  double getNoiseFactor() const { return params_.noise_factor; }
  /// Side of the cells in which the ground may bend, metres; 0 = one plane only.
  void setSlopeCell(double metres);
  double getSlopeCell() const { return params_.slope_cell; }
  void setMaxSlope(double radians);
  double getMaxSlope() const { return params_.max_slope; }
  /// What continues this far above the ground is a wall and keeps its foot; 0 = off.
  void setWallHeight(double metres);
  double getWallHeight() const { return params_.wall_height; }
  void setWallCell(double metres);
  double getWallCell() const { return params_.wall_cell; }
  void setWallFootThreshold(double metres);
  double getWallFootThreshold() const { return params_.wall_foot_threshold; }
  /// Share of the finite points that must support the ground.
  void setMinShare(double share);
  double getMinShare() const { return params_.min_share; }
  void setMinPoints(int points);
  int getMinPoints() const { return params_.min_points; }
  void setSampleSize(int points);
  int getSampleSize() const { return params_.sample_size; }
  void setSeed(std::uint64_t seed);
  std::uint64_t getSeed() const { return params_.seed; }

  PCL_MAKE_ALIGNED_OPERATOR_NEW

 protected:
  std::vector<detail::Verdict> judge(const PointCloud& cloud, const Indices* indices) override;

 private:
  GroundParams params_;
  Ground ground_;
};

extern template class PLANAR_MAPPING_EXPORT GroundRemoval<pcl::PointXYZ>;
extern template class PLANAR_MAPPING_EXPORT GroundRemoval<pcl::PointXYZI>;
extern template class PLANAR_MAPPING_EXPORT GroundRemoval<pcl::PointXYZL>;
extern template class PLANAR_MAPPING_EXPORT GroundRemoval<pcl::PointXYZRGB>;
extern template class PLANAR_MAPPING_EXPORT GroundRemoval<pcl::PointXYZRGBA>;
extern template class PLANAR_MAPPING_EXPORT GroundRemoval<pcl::PointNormal>;
extern template class PLANAR_MAPPING_EXPORT GroundRemoval<pcl::PointXYZRGBNormal>;
extern template class PLANAR_MAPPING_EXPORT GroundRemoval<pcl::PointXYZINormal>;

}  // namespace planar_mapping

#include "planar_mapping/filters/impl/ground_removal.hpp"
