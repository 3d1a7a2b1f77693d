// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "evaluation/simulation/ray_caster.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/io/image_file.h"

namespace planar_mapping::evaluation {

/// What the camera's chip adds to the light that falls on it.
struct PLANAR_MAPPING_EXPORT ImageSensorParams {
  bool color = false;      ///< RGB instead of gray
  double noise = 1.5;      ///< standard deviation of each pixel, gray levels of 255, in [0, 100]
  std::uint64_t seed = 0;  ///< of the noise
  double exposure = 1.0;   ///< factor of all gray values, > 0; they are cut off at 255

  /// \throws ParameterError
  void validate() const;
};

/// The image of a view: its colours, with pixels at the border of surfaces averaged over 16 rays,
/// and noise. Threads change nothing but the time.
/// \param view    of the same scene, camera pose and parameters, made by render() with colours
/// \throws InputError for a view without colours; ParameterError
PLANAR_MAPPING_EXPORT io::Image renderImage(const Scene& scene, const Rendering& view,
                                            const Pose& T_world_camera, const RenderParams& params,
                                            const ImageSensorParams& sensor);

}  // namespace planar_mapping::evaluation
