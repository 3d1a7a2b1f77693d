// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/beliefs/belief_update.h"
#include "planar_mapping/beliefs/occupancy.h"

namespace planar_mapping {

/// What x is in Eq. 9, which the paper leaves open.
enum class MotionReading : std::uint8_t {
  FeaturePosition,  ///< the feature's position, carried over by R, T
  RobotPose,        ///< the robot's pose: measured motion against predicted motion
};

/// Parameters of FeatureBeliefs.
struct PLANAR_MAPPING_EXPORT FeatureBeliefParams {
  OccupancyParams occupancy;
  BeliefUpdateParams update;
  MotionReading motion_reading = MotionReading::FeaturePosition;
  /// [ours] Features not seen for this many frames are forgotten; 0 = never.
  int max_unseen_frames = 0;

  /// \throws ParameterError
  void validate() const;
};

/// How the sensor moved between the frame before and this one (the paper, Eq. 8).
struct PLANAR_MAPPING_EXPORT FrameMotion {
  Pose T_now_before = Pose::Identity();  ///< measured: coordinates before to coordinates now
  Matrix6 covariance = Matrix6::Zero();  ///< of the motion error, see Matrix6
  /// MotionReading::RobotPose: the motion that was expected, e.g. from odometry; absent = as
  /// measured.
  std::optional<Pose> predicted;

  /// \throws ParameterError if the covariance is none, InputError if a pose is not finite
  void validate() const;
};

/// Beliefs of tracked features over frames (the paper, III-D and III-E, Eq. 4 to 10).
///
/// A new feature starts from Eq. 4; one seen again is updated by Eq. 10; one not seen keeps its
/// belief. The result of a frame depends on the frames before it, not on the order of features.
/// Copyable. Not thread safe.
class PLANAR_MAPPING_EXPORT FeatureBeliefs {
 public:
  struct Observation {
    std::int64_t track = -1;             ///< identity of the feature, >= 0
    Vector3 position = Vector3::Zero();  ///< relative to the sensor, metres
    double probability = 0.0;            ///< Eq. 4 in this frame, in [0, 1]
    bool keeps = false;                  ///< if it is known, its belief stays as it is
  };
  struct Summary {
    std::size_t created = 0;    ///< seen for the first time
    std::size_t updated = 0;    ///< seen again
    std::size_t unseen = 0;     ///< known, not seen in this frame
    std::size_t forgotten = 0;  ///< see FeatureBeliefParams::max_unseen_frames
  };

  /// Largest coordinate of a feature, metres: its square has to stay finite.
  static constexpr double kFarthest = 1e12;

  explicit FeatureBeliefs(const FeatureBeliefParams& params = FeatureBeliefParams());

  /// Takes effect from the next frame on; beliefs stay.
  /// \throws ParameterError
  void setParams(const FeatureBeliefParams& params);
  const FeatureBeliefParams& params() const { return params_; }

  /// One frame. A track that occurs more than once in it counts once, with the mean probability
  /// and mean position of its observations.
  /// \param motion  from the frame before to this one; absent = unknown: the factor of Eq. 9 is 1
  ///                and positions of earlier frames are not compared with those from here on
  /// \throws ParameterError for probabilities out of range or positions that are not finite or
  /// beyond kFarthest,
  ///         InputError for a negative track; beliefs are then unchanged
  Summary update(const std::vector<Observation>& frame,
                 const std::optional<FrameMotion>& motion = std::nullopt);

  /// Belief of a track in [0, 1], or nothing if it is not known.
  std::optional<double> belief(std::int64_t track) const;
  /// All known tracks, ascending.
  std::vector<std::int64_t> tracks() const;
  std::size_t size() const { return known_.size(); }
  std::size_t frames() const { return static_cast<std::size_t>(frame_); }
  /// Forgets everything but the parameters.
  void clear();

 private:
  struct Track {
    double belief = 0.0;
    Vector3 position = Vector3::Zero();  ///< when last seen, relative to the sensor then
    std::int64_t frame = 0;              ///< when last seen
  };
  /// Of a frame.
  struct Place {
    std::int64_t chain = 0;  ///< an unknown motion starts a new chain
    Pose T_sensor_chain = Pose::Identity();
    Matrix6 covariance = Matrix6::Zero();  ///< of the chain up to the frame
    std::size_t tracks = 0;                ///< last seen in it
  };

  double factorOf(const Track& track, const Vector3& position, double pose_factor) const;
  void leave(std::int64_t frame);
  std::size_t forgetUnseen();

  FeatureBeliefParams params_;
  std::unordered_map<std::int64_t, Track> known_;
  std::map<std::int64_t, Place> seen_in_;  ///< the frames that tracks were last seen in
  Place now_;
  std::int64_t frame_ = 0;
};

}  // namespace planar_mapping
