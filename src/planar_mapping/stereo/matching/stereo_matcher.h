// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "planar_mapping/base/export.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/stereo/disparity_image.h"

namespace planar_mapping {

/// Directions along which semi-global matching adds up smoothness.
enum class SmoothnessPaths : std::uint8_t {
  Three,  ///< from left, right and above; fastest
  Five,   ///< all from above and both sides
  Eight,  ///< all; two passes over the whole cost volume
};

/// Parameters of StereoMatcher. Disparities in pixels; all but the method itself is [ours].
struct PLANAR_MAPPING_EXPORT StereoMatcherParams {
  /// Smallest disparity looked for. Absent = found in each pair by a coarse search, and never less
  /// than that of infinity, cx - cx_right.
  std::optional<int> min_disparity;
  /// Number of disparities looked at. Absent = found in each pair by a coarse search.
  std::optional<int> disparities;
  /// Nothing nearer than this is looked for, metres; limits the coarse search. 0 = up to
  /// max_disparity_fraction.
  double near_distance = 0.0;
  /// Largest disparity the coarse search looks at, in image widths.
  double max_disparity_fraction = 0.5;
  SmoothnessPaths paths = SmoothnessPaths::Three;
  int block_size = 5;               ///< side of the window compared, odd
  double smoothness_small = 8.0;    ///< P1: cost of a step of 1 px, per pixel of the window
  double smoothness_large = 32.0;   ///< P2: cost of a larger step, likewise; > P1
  int prefilter_cap = 31;           ///< gray values of the horizontal derivative are cut off here
  double uniqueness_percent = 5.0;  ///< the second-best cost must be worse by so much
  /// Left and right disparities may differ by so much, in pixels; negative = not checked.
  double left_right_tolerance = 1.0;
  /// Connected regions with fewer pixels are removed; 0 = off. [ours] Of plain ones (neighbours
  /// differ by less than 0.85 gray values on average) of which fewer than three of ten have 1.5
  /// times min_agreement, those with fewer than four times as many.
  int speckle_size = 100;
  /// [ours] So are those that cover less than a square of this side at their distance, metres; 0 =
  /// off. Needs the baseline.
  double speckle_side = 0.0;
  double speckle_range = 1.0;  ///< neighbours that differ more are not connected, pixels
  /// Where neighbours along the row differ by less on average of a window, in gray values, nothing
  /// can be told: without this, semi-global matching sees plain surfaces wherever it likes.
  double min_texture = 0.2;
  /// [ours] Least correlation of the gradients of both images around a pixel: noise has none, which
  /// matching takes for texture where there is nothing else. Half of it is enough among pixels that
  /// have it (three of ten in texture_window); 0 = off.
  double min_agreement = 0.35;
  int texture_window = 25;  ///< side of the windows of both, odd
  /// Least squares on the gray values around each pixel, against the pull to whole disparities.
  bool refine = true;
  int refine_window = 9;  ///< side of the window, odd
  int threads = 1;        ///< 0 = all cores; never changes the result

  /// \throws ParameterError
  void validate() const;
};

/// What StereoMatcher::match() did.
struct StereoReport {
  int min_disparity = 0;  ///< looked for, pixels
  int disparities = 0;    ///< looked for
  double density = 0.0;   ///< fraction of the pixels that have a disparity
  /// The pair matches far better with left and right exchanged: disparities are negative.
  bool swapped = false;
  double contrast = 0.0;    ///< mean gray difference between neighbours of the left image
  double brightness = 0.0;  ///< mean gray value of the left image
  double range_ms = 0.0;    ///< coarse search
  double match_ms = 0.0;    ///< semi-global matching with its checks
  double refine_ms = 0.0;   ///< sub-pixel pass and its checks
};

/// Dense disparity of a rectified pair: semi-global matching of blocks (Hirschmueller, PAMI 2008),
/// left-right check, sub-pixel refinement, checks for texture and agreement, speckle filter.
///
/// match() may be called from several threads at once. The result depends on the images and the
/// parameters only.
class PLANAR_MAPPING_EXPORT StereoMatcher {
 public:
  /// \throws ParameterError
  explicit StereoMatcher(const StereoMatcherParams& params = {});

  const StereoMatcherParams& params() const { return params_; }

  /// \param left, right  rectified, of one size, gray or RGB
  /// \param calibration  of the pair; only its principal points and, with near_distance, focal
  ///                     length and baseline are used
  /// \return disparities of the left image, NaN where there is none
  /// \throws InputError if the images are empty, of different sizes, or smaller than 16 x 16
  DisparityImage match(const io::Image& left, const io::Image& right,
                       const io::Calibration& calibration, StereoReport* report = nullptr) const;

 private:
  StereoMatcherParams params_;
};

}  // namespace planar_mapping
