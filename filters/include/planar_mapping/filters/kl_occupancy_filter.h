// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/memory.h>
#include <pcl/point_cloud.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/beliefs/kl_occupancy.h"
#include "planar_mapping/filters/detail/point_filter.h"
#include "planar_mapping/pcl/point_types.h"

namespace planar_mapping {

/// Keeps the points of a frame that are believed to exist (the paper, III-D and III-E, Eq. 4 to
/// 10): features seen again where they are expected gain belief, mismatches and noise lose it.
///
/// Every call of filter() is one frame and updates the beliefs, so call it once a frame; the
/// indices of what was removed come from getRemovedIndices(). With setNegative(true) the doubtful
/// points are returned instead. The engine is KlOccupancy, that of the stage `kl_occupancy`: the
/// same frames and parameters give the same probabilities, to the bit.
///
/// Features are those of the images (setInputKeyFeatures()), points of the cloud with a track
/// (setInputTracks()), or, without either, sampled from the cloud with their grid cell as identity
/// (setFeatureSource()). Cells are those of a grid in the world, so give every frame its pose:
/// points are in the sensor's frame, and its pose is the one given by setSensorPose(), else the
/// cloud's sensor_origin_ and sensor_orientation_ (VIEWPOINT).
/// Example: examples/kl_occupancy_filter.cpp.
///
/// State between runs: the beliefs; reset() clears them. Copies are independent. One object serves
/// one thread at a time.
///
/// filter() throws InputError for an index outside the cloud, tracks or labels that are not one per
/// point of the cloud, or a pose that is none; beliefs are then unchanged.
/// A user-defined PointT has to be registered (POINT_CLOUD_REGISTER_POINT_STRUCT), because PCL's
/// filters copy points by field; PCL_NO_PRECOMPILE is not needed.
template <typename PointT>
class PLANAR_MAPPING_EXPORT KLOccupancyFilter : public detail::PointFilter<PointT> {
 public:
  using Ptr = pcl::shared_ptr<KLOccupancyFilter<PointT>>;
  using ConstPtr = pcl::shared_ptr<const KLOccupancyFilter<PointT>>;
  using PointCloud = typename pcl::FilterIndices<PointT>::PointCloud;
  using PointCloudPtr = typename PointCloud::Ptr;
  using PointCloudConstPtr = typename PointCloud::ConstPtr;

  /// \param extract_removed_indices true: getRemovedIndices() lists what was removed
  explicit KLOccupancyFilter(bool extract_removed_indices = false);

  // Inputs of a frame. They stay until they are set again; empty = none.

  /// Features of the frame's images with their tracks, in the sensor's frame.
  void setInputKeyFeatures(const std::vector<KeyFeature>& features) { key_features_ = features; }
  const std::vector<KeyFeature>& getInputKeyFeatures() const { return key_features_; }
  /// Track of each point of the input cloud, negative = none: tracked points are features, and are
  /// believed as their tracks are.
  void setInputTracks(const std::vector<std::int64_t>& tracks) { tracks_ = tracks; }
  const std::vector<std::int64_t>& getInputTracks() const { return tracks_; }
  /// Plane of each point of the input cloud, negative = none. The group of Eq. 4 is the grid cell
  /// of one plane.
  void setInputPlaneLabels(std::vector<std::int32_t> labels) { plane_labels_ = std::move(labels); }
  const std::vector<std::int32_t>& getInputPlaneLabels() const { return plane_labels_; }
  /// T_world_sensor: coordinates of the points to coordinates of the world; absent = the cloud's.
  void setSensorPose(const std::optional<Pose>& T_world_sensor) { sensor_pose_ = T_world_sensor; }
  const std::optional<Pose>& getSensorPose() const { return sensor_pose_; }
  /// How the sensor moved from the frame before to this one (Eq. 8, 9), for tracks. Counts for the
  /// next filter() only. Without it the motion is that between the poses of both frames, free of
  /// error; where a pose is neither given nor in the cloud, it is unknown and its factor is 1.
  void setMotion(const std::optional<FrameMotion>& motion);
  const std::optional<FrameMotion>& getMotion() const { return motion_; }
  /// As above, from the pose T_now_before (coordinates before to coordinates now) and its
  /// covariance.
  void setMotion(const Pose& T_now_before, const Matrix6& covariance);

  /// Forgets all beliefs; parameters and inputs stay.
  void reset() { occupancy_.reset(); }

  // Results of the last filter().

  /// One probability in [0, 1] per point of the input cloud; 0 for points that are not finite and
  /// for points outside the indices.
  const std::vector<float>& getProbabilities() const { return probabilities_; }
  /// The same without a copy; none are left.
  std::vector<float> takeProbabilities() { return std::exchange(probabilities_, {}); }
  const KlOccupancyDiagnostics& getDiagnostics() const { return diagnostics_; }
  /// All tracks known.
  const FeatureBeliefs& getBeliefs() const { return occupancy_.tracks(); }

  // Parameters. Every setter throws ParameterError, and changes nothing, if the value is out of
  // range; units and ranges as in KlOccupancyParams.

  void setParams(const KlOccupancyParams& params) { occupancy_.setParams(params); }
  const KlOccupancyParams& getParams() const { return occupancy_.params(); }
  /// Where features come from; FeatureSource::Auto by default.
  void setFeatureSource(FeatureSource source);
  FeatureSource getFeatureSource() const { return getParams().source; }
  /// Points believed less than this fail the filter, in [0, 1]; 0.5 by default.
  void setMinProbability(double probability);
  double getMinProbability() const { return getParams().min_probability; }
  /// Side of the grid cell whose features make a group, metres.
  void setResolution(double metres);
  double getResolution() const { return getParams().resolution; }
  /// [ours] Smallest range error of Eq. 4, in cells; 0 = the paper.
  void setRangeFloor(double cells);
  double getRangeFloor() const { return getParams().range_floor_cells; }
  void setNoiseModel(const StereoNoise& noise);
  const StereoNoise& getNoiseModel() const { return getParams().beliefs.occupancy.noise; }
  /// [ours] Belief in a feature that is alone in its group, in [0, 1].
  void setSingleFeatureProbability(double probability);
  double getSingleFeatureProbability() const {
    return getParams().beliefs.occupancy.single_feature_probability;
  }
  /// Direction of depth in the cloud's frame; zero = depth is the range (laser scanners);
  /// std::nullopt (the default) = z if the first cloud is a camera's (isCameraView()), else zero.
  void setOpticalAxis(const std::optional<Vector3>& axis);
  const std::optional<Vector3>& getOpticalAxis() const { return getParams().optical_axis; }
  /// A of Eq. 10, 1.07 in the paper.
  void setBias(double bias);
  double getBias() const { return getParams().beliefs.update.bias; }
  /// Eq. 5 to 10, or a simpler rule as comparison.
  void setUpdateRule(UpdateRule rule);
  UpdateRule getUpdateRule() const { return getParams().beliefs.update.rule; }
  /// [ours] Points sampled in each cell of each plane.
  void setFeaturesPerCell(int features);
  int getFeaturesPerCell() const { return getParams().features_per_cell; }
  /// [ours] Eq. 4 is over tracked features and the sampled points of their cell.
  void setDenseGroups(bool dense);
  bool getDenseGroups() const { return getParams().dense_groups; }
  /// [ours] Beliefs below 0.5 spread to adjacent cells like others.
  void setDoubtSpreads(bool spreads);
  bool getDoubtSpreads() const { return getParams().doubt_spreads; }
  /// 0 = all cores; never changes the result.
  void setNumberOfThreads(int threads);
  int getNumberOfThreads() const { return getParams().threads; }
  void setMotionReading(MotionReading reading);
  MotionReading getMotionReading() const { return getParams().beliefs.motion_reading; }
  /// [ours] Features not seen for this many frames are forgotten; 0 = never.
  void setMaxUnseenFrames(int frames);
  int getMaxUnseenFrames() const { return getParams().beliefs.max_unseen_frames; }

  PCL_MAKE_ALIGNED_OPERATOR_NEW

 protected:
  std::vector<std::uint8_t> test(const PointCloud& cloud, const Indices* indices) override;

 private:
  KlOccupancy occupancy_;
  std::vector<KeyFeature> key_features_;
  std::vector<std::int64_t> tracks_;
  std::vector<std::int32_t> plane_labels_;
  std::optional<Pose> sensor_pose_;
  std::optional<FrameMotion> motion_;
  std::vector<float> probabilities_;
  KlOccupancyDiagnostics diagnostics_;
};

PLANAR_MAPPING_FOR_POINT_TYPES(extern template class PLANAR_MAPPING_EXPORT, KLOccupancyFilter)

}  // namespace planar_mapping

#include "planar_mapping/filters/impl/kl_occupancy_filter.hpp"
