// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <optional>

#include "planar_mapping/localization/localizer.h"
#include "planar_mapping/localization/registration/surface_map.h"
#include "planar_mapping/pipeline/frame.h"
#include "planar_mapping/pipeline/motion/motion_keys.h"

namespace planar_mapping::detail {

/// [ours] Places clouds that no image was taken with, by their surfaces. One that fits nowhere, or
/// at several places, begins a track of its own.
class CloudLocator {
 public:
  explicit CloudLocator(const SurfaceMapParams& params) : params_(params) {}

  /// \param is_partial       of a camera, which sees a part of its surroundings only
  /// \param prior            guess of where the sensor is, in a world of its own: steps count
  /// \param step_covariance  of such a step
  /// \param start            pose of a sensor that begins a track, z up: turns are about that
  Localization locate(const PointsView& cloud, bool is_partial, const std::optional<Pose>& prior,
                      const Matrix6& step_covariance, const std::function<Pose()>& start);

 private:
  struct Track {
    explicit Track(const SurfaceMapParams& params) : map(params) {}

    SurfaceMap map;
    Pose T_track_sensor = Pose::Identity();
    Pose T_before_now = Pose::Identity();
    std::optional<Pose> T_track_given;  ///< by the last cloud that had a guess
    std::size_t frame = 0;              ///< the cloud at T_track_sensor
    int uncorrected = 0;                ///< steps between guesses since a cloud told
  };
  static CloudRegistration placeIn(const Track& track, const PointsView& cloud, bool is_partial,
                                   int lost);
  static CloudRegistration follow(Track& track, const PointsView& cloud, const Pose& prior,
                                  const Matrix6& step_covariance);

  SurfaceMapParams params_;
  std::size_t frames_ = 0;
  std::map<std::size_t, Track> tracks_;
};

/// [ours] Places the frames of a sequence one after the other: by their images and clouds
/// (Localizer), or, where the first frame has no image of its cloud, by their clouds.
class FrameLocator {
 public:
  /// \param keys  read with the first frame; has to live as long
  explicit FrameLocator(const MotionKeys& keys) : keys_(keys) {}

  /// Of clouds, see CloudScale::optical. Before the first frame.
  void setOptical(bool optical) { is_optical_ = optical; }
  /// \param frame            gets notes of how the world is found to lie; see Frame::starts_world
  /// \param step_covariance  of the step between given poses; null: they are not looked at
  /// \return poses in the world of the track; nothing where the frame has no image, unlike the
  /// first
  std::optional<Localization> locate(Frame& frame, const Matrix6* step_covariance);

 private:
  Pose startOf(Frame& frame, bool by_guess) const;
#ifdef PLANAR_MAPPING_HAS_STEREO
  Localization locateImage(Frame& frame, const std::optional<Pose>& prior,
                           const Matrix6* step_covariance);
#endif

  const MotionKeys& keys_;
  bool is_optical_ = true;
#ifdef PLANAR_MAPPING_HAS_STEREO
  std::optional<Localizer> images_;
  std::map<std::size_t, Pose> T_world_start_;  ///< by track, of images
#endif
  std::optional<CloudLocator> clouds_;
};

}  // namespace planar_mapping::detail
