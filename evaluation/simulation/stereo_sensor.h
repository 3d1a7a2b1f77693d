// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "evaluation/simulation/ray_caster.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping::evaluation {

/// A stereo camera that measures disparities as matchers do: with errors that are alike among
/// neighbours, in steps, smeared at depth edges, and not at all where the second camera sees
/// nothing or there is nothing to match. Pixels are those of the left image.
struct PLANAR_MAPPING_EXPORT StereoSensorParams {
  double baseline = 0.12;              ///< metres, > 0
  double noise_px = 0.25;              ///< [ours] standard deviation of the disparity, >= 0
  double correlated_fraction = 0.7;    ///< fraction of its variance that neighbours have in common
  double correlation_px = 8.0;         ///< how far neighbours reach, >= 1
  double disparity_step_px = 0.0625;   ///< of the matcher's sub-pixel result; 0 = continuous
  double smallest_disparity_px = 3.0;  ///< what is farther is not measured, > 0
  double edge_px = 1.0;                ///< a jump of the disparity that makes an edge, > 0
  double flying_fraction = 0.25;       ///< of the pixels at an edge: somewhere between both sides
  double edge_hole_fraction = 0.25;    ///< of the pixels at an edge: nothing
  double hole_fraction = 0.35;         ///< of a surface without any texture: nothing, in patches
  double smallest_incidence = 0.06;    ///< cosine below which a surface is not matched
  double wrong_fraction = 0.0;         ///< of the measured pixels: matched with something else
  int wrong_patch_px = 3;              ///< wrong matches come in squares of this side, >= 1

  /// \throws ParameterError
  void validate() const;
  /// As above, without any error: exact disparities wherever there is a surface.
  static StereoSensorParams perfect();
};

/// Disparities (pixels) of the rendered view, 0 = none. The same random state gives the same.
/// \throws ParameterError
PLANAR_MAPPING_EXPORT std::vector<float> measureDisparity(const Rendering& rendering,
                                                          const StereoSensorParams& params,
                                                          Random& random);

/// What of a view both cameras see, near and steep enough to be matched, with texture or without;
/// of all other pixels the object is -1.
/// \throws ParameterError
PLANAR_MAPPING_EXPORT Rendering matchablePart(Rendering view, const StereoSensorParams& params);

/// Points in the camera frame, three floats a pixel, NaN without disparity; z = B fx / d.
PLANAR_MAPPING_EXPORT std::vector<float> pointsOf(const std::vector<float>& disparity,
                                                  const PinholeCamera& camera, double baseline);

}  // namespace planar_mapping::evaluation
