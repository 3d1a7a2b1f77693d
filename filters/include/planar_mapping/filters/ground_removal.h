// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/memory.h>
#include <pcl/point_cloud.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/filters/detail/point_filter.h"
#include "planar_mapping/ground/ground.h"
#include "planar_mapping/pcl/point_types.h"

namespace planar_mapping {

/// Removes the ground of a frame (the paper, III-F, assumption 2): a plane below the sensor, bent
/// along slopes. Steps, kerbs and the feet of walls stay.
///
/// filter() returns what stands on the ground; with setNegative(true) the ground itself, which
/// still has to clear free space. Where no ground is found nothing is removed, and
/// getDiagnostics().status says why. The engine is GroundTracker, that of the stage
/// `ground_removal`: the same frames and parameters give the same points.
///
/// Points are in the sensor's frame. The pose of the sensor is the one given by setSensorPose(),
/// else the cloud's sensor_origin_ and sensor_orientation_ (VIEWPOINT). By default the vertical is
/// that of a camera (y down) or of a scan (z up), whichever the first cloud looks like, and the
/// height of the sensor is found; over frames with poses the ground is then expected where it was.
/// Example: examples/ground_removal.cpp.
///
/// State between runs: where the ground is; reset() clears it, and clouds that have nothing to do
/// with each other need it. One object serves one thread at a time; copies are independent.
/// filter() throws InputError for an index outside the cloud, a pose that is none, or a cloud that
/// cannot be in metres.
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

  /// T_world_sensor: coordinates of the points to coordinates of the world; absent = the cloud's.
  void setSensorPose(const std::optional<Pose>& T_world_sensor) { sensor_pose_ = T_world_sensor; }
  const std::optional<Pose>& getSensorPose() const { return sensor_pose_; }
  /// Forgets where the ground was; parameters stay.
  void reset() { tracker_.reset(); }

  // Results of the last filter().

  /// The ground at the sensor: plane (normal upwards), covariance, residual, height, found or not.
  const Ground& getGround() const { return ground_; }
  /// Its coefficients a, b, c, d and their covariance; both zero where no ground was found.
  void getGroundPlane(Vector4& coefficients, Matrix4& covariance) const;
  const GroundDiagnostics& getDiagnostics() const { return ground_.diagnostics; }

  // Parameters. Every setter throws ParameterError, and changes nothing, if the value is out of
  // range; units and ranges as in GroundParams.

  void setParams(const GroundParams& params) { tracker_.setParams(params); }
  const GroundParams& getParams() const { return tracker_.params(); }
  /// Height of the sensor over the ground, metres; absent (the default) = found, and expected by
  /// the frames before; 0 = found anew in every frame. The paper's is 0.37 m.
  void setCameraHeight(const std::optional<double>& metres);
  const std::optional<double>& getCameraHeight() const { return getParams().camera_height; }
  void setHeightTolerance(double metres);
  double getHeightTolerance() const { return getParams().height_tolerance; }
  /// Upwards in the world (without a pose: in the cloud's frame); any length but zero; absent (the
  /// default) = by the first cloud, see verticalOf().
  void setUpAxis(const std::optional<Vector3>& up);
  const std::optional<Vector3>& getUpAxis() const { return getParams().up; }
  /// Where the camera looks, in the sensor's frame; any length but zero.
  void setOpticalAxis(const Vector3& axis);
  const Vector3& getOpticalAxis() const { return getParams().optical_axis; }
  void setPitchTolerance(double radians);
  double getPitchTolerance() const { return getParams().pitch_tolerance; }
  void setRollTolerance(double radians);
  double getRollTolerance() const { return getParams().roll_tolerance; }
  void setDistanceThreshold(double metres);
  double getDistanceThreshold() const { return getParams().distance_threshold; }
  /// The threshold follows the stereo noise; absent = it does not.
  void setNoiseModel(const std::optional<StereoNoise>& noise);
  const std::optional<StereoNoise>& getNoiseModel() const { return getParams().noise; }
  void setNoiseFactor(double factor);
  double getNoiseFactor() const { return getParams().noise_factor; }
  /// Side of the cells in which the ground may bend, metres; 0 = one plane only.
  void setSlopeCell(double metres);
  double getSlopeCell() const { return getParams().slope_cell; }
  void setMaxSlope(double radians);
  double getMaxSlope() const { return getParams().max_slope; }
  /// What continues this far above the ground is a wall and keeps its foot; 0 = off.
  void setWallHeight(double metres);
  double getWallHeight() const { return getParams().wall_height; }
  void setWallCell(double metres);
  double getWallCell() const { return getParams().wall_cell; }
  void setWallFootThreshold(double metres);
  double getWallFootThreshold() const { return getParams().wall_foot_threshold; }
  /// Fraction of the finite points that must support the ground.
  void setMinFraction(double fraction);
  double getMinFraction() const { return getParams().min_fraction; }
  void setMinPoints(int points);
  int getMinPoints() const { return getParams().min_points; }
  void setSampleSize(int points);
  int getSampleSize() const { return getParams().sample_size; }
  /// 0 = all cores; never changes the result.
  void setNumberOfThreads(int threads);
  int getNumberOfThreads() const { return getParams().threads; }
  void setSeed(std::uint64_t seed);
  std::uint64_t getSeed() const { return getParams().seed; }

  PCL_MAKE_ALIGNED_OPERATOR_NEW

 protected:
  std::vector<std::uint8_t> test(const PointCloud& cloud, const Indices* indices) override;

 private:
  GroundTracker tracker_;
  std::optional<Pose> sensor_pose_;
  Ground ground_;
};

PLANAR_MAPPING_FOR_POINT_TYPES(extern template class PLANAR_MAPPING_EXPORT, GroundRemoval)

}  // namespace planar_mapping

#include "planar_mapping/filters/impl/ground_removal.hpp"
