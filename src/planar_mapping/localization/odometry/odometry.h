// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/beliefs/feature_beliefs.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping {

/// Parameters of Odometry; all [ours], the paper (IV) registers frame to frame.
struct PLANAR_MAPPING_EXPORT OdometryParams {
  FeatureCamera camera;
  MotionParams motion;
  /// A frame becomes a keyframe once the camera has moved by this fraction of the median depth of
  /// what it sees, ...
  double keyframe_translation = 0.05;  ///< > 0
  double keyframe_rotation = 0.087;    ///< ... has turned so far, radians, > 0, or sees much less
  int max_landmarks = 20000;           ///< kept, >= 100; those not seen for longest go first
  /// A motion that differs from the expected one by more than this is a jump, metres, > 0. Things
  /// that repeat, such as tiles, make small sets of wrong matches agree on one: it is believed only
  /// if this fraction of the known features agrees ...
  double jump_distance = 0.5;
  double jump_inlier_fraction = 0.4;  ///< in [0, 1]
  int jump_inliers = 30;              ///< ... or so many of them, and a fifth
  std::uint64_t seed = 12345;

  /// \throws ParameterError
  void validate() const;
};

/// What is known of a frame's pose from outside.
struct PosePrior {
  Pose T_world_sensor = Pose::Identity();
  /// Of position (metres) and orientation (radians), in the sensor's frame; see Matrix6.
  Matrix6 covariance = Matrix6::Identity();
  /// The pose is taken as it is; the covariance does not count.
  bool exact = false;
  /// Measured without the map, such as by wheels or a tracker: it tells where the map as a whole,
  /// which follows its own poses, has drifted to. Many features tell that no better than few.
  bool independent = false;
};

/// What became of a frame.
struct OdometryResult {
  bool registered = false;  ///< else nothing below but `reason`, `matches`, `inliers` holds
  std::string reason;       ///< why it could not be registered, a sentence without full stop
  Pose T_world_sensor = Pose::Identity();
  /// Since the last frame that was registered; nothing for the first one.
  std::optional<FrameMotion> motion;
  std::vector<std::uint8_t> is_inlier;  ///< one per feature: it agrees with the map
  std::size_t features = 0;             ///< with a usable position
  std::size_t matches = 0;              ///< of those, known to the map
  std::size_t inliers = 0;              ///< of those, in agreement with the pose
  double rms_px = 0.0;                  ///< reprojection error of the inliers
  bool keyframe = false;
  bool from_prior = false;  ///< the features did not tell, the pose is the prior's
  bool jump = false;        ///< see OdometryParams::jump_distance
};

/// Pose of a camera over frames, from its key features (the paper, IV, and Eq. 8).
///
/// Keeps a bounded local map of landmarks, which each sighting makes more certain, and registers
/// each frame to it by estimateMotion(). A feature that comes back under its identity counts
/// however long it was away, so a frame after a gap is registered as soon as it sees something
/// known. A frame that cannot be registered changes nothing.
///
/// Where nothing known is ever seen again, no frame is registered again: a guessed pose would put
/// a second copy of the world into the map. A prior restarts it (see PosePrior).
///
/// The result depends on the frames, not on the order of features. Copyable. Not thread safe. One
/// that was moved from can only be assigned to or destroyed.
class PLANAR_MAPPING_EXPORT Odometry {
 public:
  explicit Odometry(const OdometryParams& params = OdometryParams());
  ~Odometry();
  Odometry(const Odometry& other);
  Odometry& operator=(const Odometry& other);
  Odometry(Odometry&&) noexcept;
  Odometry& operator=(Odometry&&) noexcept;

  const OdometryParams& params() const;

  /// Pose of the first frame that is registered without a prior; identity if never called.
  /// \throws InputError if the pose is not finite
  void setStart(const Pose& T_world_sensor);

  /// One frame. A track that occurs more than once in it is left out.
  /// \throws InputError for a negative track or a prior that is not finite; nothing has changed
  OdometryResult update(const std::vector<KeyFeature>& features,
                        const std::optional<PosePrior>& prior = std::nullopt);

  /// Where the next frame is expected, by the motion of the last one; the start pose before.
  Pose expectedPose() const;
  /// Whether the last frame was registered and its motion is known: else expectedPose() is where
  /// the camera was.
  bool hasVelocity() const;
  /// The pose of a frame by its features alone, without taking it into the map; see update().
  OdometryResult locate(const std::vector<KeyFeature>& features,
                        const std::optional<PosePrior>& prior = std::nullopt) const;

  /// True once a frame has been registered.
  bool started() const;
  std::size_t landmarks() const;
  /// Position of a landmark in the world, or nothing if it is not known.
  std::optional<Vector3> landmark(std::int64_t track) const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace planar_mapping
