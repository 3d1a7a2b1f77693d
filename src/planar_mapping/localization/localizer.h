// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/beliefs/occupancy.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/io/image_file.h"

namespace planar_mapping {

/// Standard deviations of what a sensor measures; all [ours].
struct PLANAR_MAPPING_EXPORT SensorNoise {
  double pixel = 0.5;            ///< of a feature's column and row, pixels
  double pixel_per_size = 0.1;   ///< of its diameter, added to that
  double inverse_depth = 0.003;  ///< 1/m
  double relative = 0.005;       ///< of inverse depth: scale, interpolation
  double gray = 8.0;             ///< of the mean of a cell, gray levels: light, aliasing

  /// \param disparity_error  pixels
  static SensorNoise ofPair(double focal_length, double baseline, double disparity_error = 0.3);
  /// Of an inverse depth, beside the spread around it.
  double depthSigma(double rho) const;
  /// \throws ParameterError
  void validate() const;
};

/// A frame as its sensor measured it; nothing is kept of it.
struct LocalizerFrame {
  io::Image gray;    ///< one channel
  PointsView cloud;  ///< organized, of the size of the image, camera frame, metres
  PinholeCamera camera;
  /// A guess of where the camera is, in the world of whoever made it: steps between guesses count.
  std::optional<Pose> prior;
  Matrix6 prior_covariance = Matrix6::Identity();  ///< of the step since the guess before
};

/// What speaks for a pose.
struct PoseEvidence {
  std::size_t inliers = 0;    ///< features that agree with it
  std::size_t expected = 0;   ///< that should be seen from there
  std::size_t off_plane = 0;  ///< inliers beside the plane that holds most of them
  double agreement = 0.0;  ///< fraction of the depths both see that agree, the worse of both ways
  double seen_through = 0.0;  ///< fraction that lies where the other saw through, the worse
  double overlap = 0.0;       ///< fraction of the cells that the other sees, the worse
  double correlation = 0.0;   ///< of gray values freed of local mean and contrast
  double rival = 0.0;         ///< odds of other poses that were found, over those of this one
  double log_odds = 0.0;      ///< natural logarithm of right over wrong, of all this together

  /// Of the features expected; where these are few they say little by themselves.
  double seenAgain() const {
    constexpr double kFew = 10.0;
    return static_cast<double>(inliers) / (static_cast<double>(expected) + kFew);
  }
};

/// A submap that is found to lie in another one: what was said to be in it is in that one.
struct JoinedSubmap {
  std::size_t submap = 0;
  Pose T_other_submap = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< see Matrix6
};

/// Where a frame is.
struct Localization {
  std::size_t submap = 0;      ///< from 0
  bool begins_submap = false;  ///< it has no link to any frame before
  bool is_keyframe = false;
  Pose T_submap_camera = Pose::Identity();
  /// Of T_submap_camera, see Matrix6; zero for the first of a submap.
  Matrix6 covariance = Matrix6::Zero();
  /// The same error seen from the camera: of T_camera_submap, see Matrix6.
  Matrix6 covariance_in_camera = Matrix6::Zero();
  /// What later frames, which are placed by this one, are farther off than those before: zero but
  /// of keyframes. See covariance_in_camera.
  Matrix6 drift_in_camera = Matrix6::Zero();
  /// A step later motion tells where a submap began: this one, which is no more, lies in `submap`.
  std::optional<JoinedSubmap> joined;
  PoseEvidence evidence;  ///< of a frame that begins a submap: of the likeliest link, refused
};

/// Parameters of Localizer; all [ours].
struct PLANAR_MAPPING_EXPORT LocalizerParams {
  SensorNoise noise;
  /// A pose is taken where right is likelier than wrong by e to the power of this.
  double min_log_odds = 0.8;
  /// A frame becomes a keyframe where it shares less with the nearest one.
  double keyframe_overlap = 0.85;

  /// \throws ParameterError
  void validate() const;
};

/// Places frames of one camera, each as it comes, by those before it.
///
/// A frame is registered to the three nearest keyframes of its submap, by features (three-point
/// RANSAC, reprojection and depth) and by surfaces (point to plane, and gray values). Where right
/// is not likelier than wrong, it begins a submap of its own; nothing is left out. The second frame
/// of a submap tells how the camera moves, and so where the last frame before it should be: where
/// that one is found there, the two submaps are one. The result depends on the frames alone, never
/// on threads or time. One thread.
class PLANAR_MAPPING_EXPORT Localizer {
 public:
  /// \throws ParameterError
  explicit Localizer(const LocalizerParams& params = {});
  ~Localizer();
  Localizer(Localizer&&) noexcept;
  Localizer& operator=(Localizer&&) noexcept;

  /// \throws InputError for an image that is not gray or of another size than the cloud
  Localization locate(const LocalizerFrame& frame);
  std::size_t submaps() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace planar_mapping
