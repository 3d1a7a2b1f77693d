// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/image_file.h"

namespace planar_mapping {

enum class FeatureDetector : std::uint8_t {
  Automatic,  ///< Orb
  Sift,
  Orb,
  Akaze,
};

/// Parameters of FeatureTracker; all [ours].
struct PLANAR_MAPPING_EXPORT FeatureTrackerParams {
  FeatureDetector detector = FeatureDetector::Automatic;
  int max_features = 800;  ///< of one image, spread evenly over it
  /// Weakest response that counts, in the detector's own unit; 0 = its usual one.
  double detection_threshold = 0.0;
  // Left to right.
  double epipolar_tolerance = 2.0;  ///< rows may differ by so much before refinement, pixels
  double stereo_ratio = 0.9;        ///< best over second-best distance along the row, at most
  double min_disparity = 0.5;       ///< of d + cx_right - cx: farther points say nothing, pixels
  double max_disparity_fraction = 0.5;  ///< of the image width
  int refine_window = 9;                ///< side of the window of the sub-pixel disparity, odd
  double max_refine_residual = 0.6;     ///< of gray value differences in it, in standard deviations
  // Frame to frame.
  double track_ratio = 0.8;   ///< best over second-best distance, at most
  int track_window = 13;      ///< side of the window of the sub-pixel place, odd
  bool refine_tracks = true;  ///< place in the new image by least squares on gray values
  int remember_frames = 50;   ///< a track lost for so many frames can be found again
  int max_remembered = 3000;  ///< lost tracks kept, the latest
  int threads = 1;            ///< 0 = all cores; never changes the result

  /// \throws ParameterError
  void validate() const;
};

/// What the tracker did with a frame.
struct FeatureReport {
  std::size_t features_left = 0;
  std::size_t features_right = 0;      ///< 0 where the cloud has the depth of enough
  std::size_t descriptor_matches = 0;  ///< left to right, before the sub-pixel pass
  std::size_t stereo_matches = 0;      ///< with a disparity, or with depth for RGB-D
  std::size_t tracked = 0;             ///< seen in the frame before
  std::size_t reseen = 0;              ///< lost for a while
  std::size_t new_tracks = 0;
  std::size_t negative_disparities = 0;  ///< matches behind infinity
  /// Most matches are behind infinity: left and right are exchanged.
  bool swapped = false;
  double detect_ms = 0.0;
  double stereo_ms = 0.0;
  double track_ms = 0.0;
};

/// Key features of a row of frames, matched left to right to 3-D positions and from frame to frame
/// to tracks (the paper, III-B).
///
/// A feature gets the track of the feature in the frame before that has its descriptor; if there is
/// none, that of a track lost within the last remember_frames frames; else a new one. Numbers of
/// tracks are never used twice. Memory is bounded by max_features and max_remembered.
///
/// Deterministic; not to be called from several threads at once.
class PLANAR_MAPPING_EXPORT FeatureTracker {
 public:
  /// \throws ParameterError
  explicit FeatureTracker(const FeatureTrackerParams& params = {});
  ~FeatureTracker();
  FeatureTracker(FeatureTracker&& other) noexcept;
  FeatureTracker& operator=(FeatureTracker&& other) noexcept;

  const FeatureTrackerParams& params() const;

  /// With more than one thread: looks for the features of an image in the background, while the
  /// caller matches the pair. track() with this as its left image, byte for byte, takes them; with
  /// another they are dropped. Never changes a result.
  void begin(const io::Image& left);

  /// A rectified pair. Features without a match in the right image are left out.
  /// \param cloud  organized, of the pair, or empty: features are looked for in the right image
  ///               where the cloud says. Where it has the depth of few, the right image has its own
  ///               features detected, and what has the same descriptor is the same.
  /// \throws InputError if the images are empty or of different sizes, the calibration has no
  ///         baseline or another size, or the cloud has another size
  std::vector<KeyFeature> track(const io::Image& left, const io::Image& right,
                                const io::Calibration& calibration, const PointsView& cloud = {});

  /// An image with an organized cloud of the same size and camera (RGB-D). Features without a
  /// finite point nearby are left out; at an edge the nearer surface counts.
  /// \throws InputError if the image is empty or the cloud has another size
  std::vector<KeyFeature> track(const io::Image& image, const PointsView& cloud);

  const FeatureReport& report() const;
  /// Forgets all tracks; numbers go on.
  void reset();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace planar_mapping
