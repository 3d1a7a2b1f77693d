// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/ModelCoefficients.h>
#include <pcl/PointIndices.h>

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping {

/// What PlanarMapping and PlanarCuboidApproximation know of a frame besides its cloud, and the
/// parameters of their map.
///
/// The points of a cloud are in the sensor's frame. The sensor's pose in the world is the one given
/// to setSensorPose(), else the cloud's sensor_origin_ and sensor_orientation_ (the VIEWPOINT of a
/// PCD file), as in `planar_map run`; identity where nobody set one. Planes are in the sensor's
/// frame, cuboids and the map in the world.
class PLANAR_MAPPING_EXPORT MappingInput {
 public:
  /// Planes of the cloud with their inliers; points in none of them are the non-planar part. They
  /// stay until they are set again: set those of each cloud after it. Without a noise model those
  /// that are off most of their inliers by more than five cells and 5 % of the range are refused.
  /// \param inliers indices into the input cloud, disjoint, one set per plane
  /// \param planes  (a, b, c, d) of a x + b y + c z + d = 0, of any length and orientation
  /// \throws InputError if the sizes disagree or a plane has not four coefficients,
  ///         ParameterError if its normal is zero or something is not finite
  /// \note Coefficients are floats: a point on the border of two cells may fall into the other one
  ///       than with the planes of MultiPlaneSACSegmentation::getPlanes().
  void setPlanes(const std::vector<pcl::PointIndices>& inliers,
                 const std::vector<pcl::ModelCoefficients>& planes);
  /// As above, from MultiPlaneSACSegmentation::getPlanes() or findPlanes(), in double precision.
  void setPlanes(std::vector<PlaneSegment> planes) { planes_ = std::move(planes); }
  const std::vector<PlaneSegment>& getPlanes() const { return planes_; }
  /// The same without a copy; none are left.
  std::vector<PlaneSegment> takePlanes() { return std::exchange(planes_, {}); }

  /// Belief for each point of the input cloud, in [0, 1]; empty (the default) = 1.
  void setPointProbabilities(std::vector<float> probabilities) {
    probabilities_ = std::move(probabilities);
  }
  const std::vector<float>& getPointProbabilities() const { return probabilities_; }
  /// The same without a copy; none are left.
  std::vector<float> takePointProbabilities() { return std::exchange(probabilities_, {}); }

  /// Of the planes, where nothing was measured, see assumePoints(); empty (the default) = none.
  void setAssumedPoints(const AssumedPoints& assumed) { assumed_ = assumed; }
  const AssumedPoints& getAssumedPoints() const { return assumed_; }

  /// Points that were removed as ground: they clear space, but make no cuboid.
  void setGroundIndices(const Indices& ground) { ground_ = ground; }
  const Indices& getGroundIndices() const { return ground_; }

  /// T_world_sensor; std::nullopt (the default) = the pose of the cloud. A map of PlanarMapping
  /// that begins with a cloud which has neither, and cannot have been seen from its origin
  /// (isMerged()), has PlanarMapParams::unknown_space false; a pose that is set, also the identity,
  /// prevents that.
  void setSensorPose(const std::optional<Pose>& T_world_sensor) { sensor_pose_ = T_world_sensor; }
  const std::optional<Pose>& getSensorPose() const { return sensor_pose_; }

  /// For clouds in the coordinates of the world, as OctoMap's insertPointCloud(cloud, origin) has
  /// them: where the sensor stood, metres. Planes are in the same coordinates, and no pose counts.
  /// std::nullopt (the default) = clouds are in the sensor's frame.
  void setSensorOrigin(const std::optional<Vector3>& position) { sensor_origin_ = position; }
  const std::optional<Vector3>& getSensorOrigin() const { return sensor_origin_; }

  /// Seconds; std::nullopt (the default) = the stamp in the header of the cloud.
  void setTimestamp(const std::optional<double>& seconds) { timestamp_ = seconds; }
  const std::optional<double>& getTimestamp() const { return timestamp_; }

  /// Intrinsics of an organized cloud; std::nullopt (the default) = estimated from the cloud.
  void setCamera(const std::optional<PinholeCamera>& camera) { camera_ = camera; }
  const std::optional<PinholeCamera>& getCamera() const { return camera_; }

  /// Depth error of a stereo camera; std::nullopt (the default) = none.
  /// \throws ParameterError
  void setNoiseModel(const std::optional<StereoNoise>& noise);
  const std::optional<StereoNoise>& getNoiseModel() const { return noise_; }

  // Every setter below throws ParameterError, and changes nothing, if the value is out of range.

  /// All parameters at once; none is found from the cloud then.
  void setParams(const PlanarMapParams& params);
  const PlanarMapParams& getParams() const { return params_; }

  /// Paper: nothing beyond the paper. Compact (the default): as few cuboids as we can. Sets the
  /// profile alone; PlanarMapParams::of() has all defaults of one.
  void setProfile(Profile profile);
  Profile getProfile() const { return params_.approximation.profile; }
  /// s, side of the smallest cell, metres, > 0; the limits of association follow it, see
  /// PlanarMapParams::setResolution(). Until it is set it follows from the first cloud of a map,
  /// automaticResolution(), as in single_pcd.yaml; the params() of the map say what it is.
  void setResolution(double metres);
  double getResolution() const { return params_.approximation.resolution; }
  /// Extension of planar cuboids away from the sensor, metres, >= 0; 0 = the resolution.
  void setThickness(double metres);
  double getThickness() const { return params_.approximation.thickness; }
  /// Cells with fewer points are empty, >= 1.
  void setMinPointsPerCell(int points);
  int getMinPointsPerCell() const { return params_.approximation.min_points_per_cell; }
  /// Holes in a plane up to this side are filled (Compact), metres, >= 0; 0 = the resolution, less
  /// than the resolution = none.
  void setHoleSize(double metres);
  double getHoleSize() const { return params_.approximation.hole_size; }
  /// Points within this many cells of a cuboid need none of their own (Compact), in [0, 0.5].
  void setAbsorption(double cells);
  double getAbsorption() const { return params_.approximation.absorption; }
  /// Up in the world, of any length > 0; the first axis of a planar cuboid is horizontal. Until it
  /// is set it is z if a pose or an origin is set or the cloud has a pose, else it follows from the
  /// first cloud of a map, verticalOf().
  void setUpDirection(const Vector3& up);
  const Vector3& getUpDirection() const { return params_.approximation.up; }
  /// Space beyond this depth is not classified: it stays what it was, metres; 0 (the default) = as
  /// far as the first cloud lets, see PlanarMapParams::resolvedFor().
  void setMaxRange(double metres);
  double getMaxRange() const { return params_.max_range; }
  /// Cells believed less than this are removed, in [0, 1].
  void setMinProbability(double probability);
  double getMinProbability() const { return params_.min_probability; }
  /// 0 = all cores; never changes the result.
  void setNumberOfThreads(int threads);
  int getNumberOfThreads() const { return params_.approximation.threads; }

 protected:
  /// \param params  of a map; resolution and up are found from the first cloud until they are set
  explicit MappingInput(const PlanarMapParams& params = {}) : params_(params) {}
  ~MappingInput() = default;
  MappingInput(const MappingInput&) = default;
  MappingInput& operator=(const MappingInput&) = default;

  /// The parameters of a map that starts with this frame, see PlanarMapParams::resolvedFor(): one
  /// that cannot have been seen from the origin (isMerged()), and has no other pose, has no sensor.
  /// \throws InputError for an index outside the cloud
  PlanarMapParams paramsFor(const PointsView& points, const Indices* indices,
                            const Pose& T_world_sensor) const;
  /// Puts a frame into the map.
  /// \param indices points that count, or null for all; those that are not finite are dropped
  /// \throws InputError as PlanarMap::insert(), if the first cloud of a map is not in metres, or if
  ///         a plane is far from most of its inliers, as one of another cloud is
  FrameUpdate insertInto(PlanarMap& map, const PointsView& points, const Indices* indices,
                         const Pose& T_world_sensor, std::uint64_t stamp_us) const;

 private:
  /// For the points that seenFrom(getSensorOrigin()) gives.
  /// \throws InputError if a pose or a camera is set, too
  MappingInput seenFromOrigin() const;

  std::vector<PlaneSegment> planes_;
  std::vector<float> probabilities_;
  AssumedPoints assumed_;
  Indices ground_;
  std::optional<Pose> sensor_pose_;
  std::optional<Vector3> sensor_origin_;
  std::optional<double> timestamp_;
  std::optional<PinholeCamera> camera_;
  std::optional<StereoNoise> noise_;
  PlanarMapParams params_;
  bool finds_resolution_ = true;
  bool finds_up_ = true;
};

}  // namespace planar_mapping
