// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/localization/odometry/odometry.h"
#include "planar_mapping/localization/registration/surface_map.h"
#include "planar_mapping/pipeline/frame.h"
#ifdef PLANAR_MAPPING_HAS_STEREO
#include "planar_mapping/localization/views/view_map.h"
#endif

namespace planar_mapping::detail {

/// Independent errors of a position, metres, and an orientation, radians.
Matrix6 poseCovariance(double position_error, double orientation_error);

/// [ours] Finds where a frame is by its features, its cloud, and what its image shows, each against
/// what earlier frames had of it. What they do not agree on is not believed.
class FrameLocator {
 public:
  /// \param surface         null: clouds do not take part
  /// \param enough_inliers  features with which a pose is believed without a cloud
  FrameLocator(const OdometryParams& params, const SurfaceMapParams* surface, int enough_inliers);

  Odometry& odometry() { return odometry_; }
  const Odometry& odometry() const { return odometry_; }
  bool usesClouds() const { return surfaces_.has_value(); }

  /// The frame that the next calls are about. Views of images that are aligned otherwise are
  /// forgotten (Frame::images_changed).
  void lookAt(const Frame& frame);
  /// What helps to find the pose of a frame that follows earlier ones; the features may correct it.
  struct Placement {
    std::optional<PosePrior> prior;
  };
  /// Nothing where the views of earlier frames do not agree, or object: see doubt().
  std::optional<Placement> place(const Frame& frame);
  /// Where its cloud lies best, next to a guess.
  CloudRegistration nearBy(const Frame& frame, const Pose& guess) const;
  /// The pose of a frame that was left out, by what has been seen since.
  std::optional<Pose> placeAgain(const Frame& frame);
  /// Makes the frame one that later ones are compared with.
  void remember(const Frame& frame);
  /// What became of the frame.
  void leaveOut() { ++lost_; }
  void accept(const OdometryResult& result);
  void setLastPose(const Pose& T_world_sensor) { last_pose_ = T_world_sensor; }

  /// Frames that were left out since the last one with a pose.
  int lostFrames() const { return lost_; }
  const std::optional<Pose>& lastPose() const { return last_pose_; }
  bool isSeen() const;  ///< an image can be compared with those of earlier frames
  /// Whether a pose is so near to where the frame is expected as one has to be that depth alone
  /// gives: a box or a corridor looks alike from its other end.
  bool isStep(const Pose& T_world_sensor) const;
  /// Whether many features give another pose, at which depths agree far better.
  bool isBetterByFeatures(const Frame& frame, const Pose& T_world_sensor) const;
  /// Whether the image hardly agrees with a pose, or as well with one farther along what the view
  /// leaves open.
  bool isAmbiguous(const Pose& T_world_sensor) const;
  /// Why place() found nothing.
  const std::string& doubt() const { return doubt_; }
  /// Why the frame could not be registered.
  std::string reasonFor(const Frame& frame, const OdometryResult& result) const;
  /// Of a pose that views settle on.
  static Matrix6 covarianceByViews() { return poseCovariance(0.02, 0.01); }

 private:
  std::optional<Placement> placeFar(const Frame& frame, const Pose& guess,
                                    std::vector<PoseCandidate> candidates);
  Placement helped(const Frame& frame, const Pose& T_world_sensor, const Matrix6& covariance,
                   const Pose& expected, bool by_views);
  Pose expectedPose(const Frame& frame) const;
  bool isDoubtful(const Frame& frame, const CloudRegistration& near, const Pose& expected) const;
  /// Does the sensor see a part of its surroundings only?
  bool isPartial(const Frame& frame) const;
  bool isSearchedFor() const;
  bool agrees(const Pose& T_world_sensor, const Pose& expected, bool likely);
  bool follows(const Pose& T_world_sensor, const Pose& expected) const;
  bool isEnough(const OdometryResult& by_features) const {
    return by_features.inliers >= static_cast<std::size_t>(enough_inliers_);
  }
  PoseCandidate candidateOf(const CloudRegistration& by_cloud) const;
  void noteCloud(const CloudRegistration& by_cloud);

  const int enough_inliers_;
  Odometry odometry_;
  std::optional<SurfaceMap> surfaces_;
#ifdef PLANAR_MAPPING_HAS_STEREO
  void startViews();
  bool mayHaveSlid(const Pose& T_world_sensor) const;
  std::optional<Pose> betterThan(const Pose& by_features, const Pose& expected,
                                 const Frame& frame) const;

  std::optional<ViewMap> views_;
  ViewMap::ViewPtr view_;  ///< of this frame; null without an image
#endif
  std::optional<Pose> last_pose_;  ///< T_world_sensor of the last frame that has one
  bool by_cloud_ = false;          ///< that frame was placed without its features
  int lost_ = 0;
  std::string doubt_;
  std::string cloud_reason_;
};

}  // namespace planar_mapping::detail
