// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/image_file.h"

namespace planar_mapping::io::layouts {

/// Images of a camera with lens distortion as the same camera without it sees them. Images of
/// another size are returned as they are: who uses them says so.
class Undistorter {
 public:
  Undistorter(const PinholeCamera& camera, const LensDistortion& lens);
  /// The nearest pixel's depth: one between two surfaces is none of both.
  DepthImage undistorted(const DepthImage& image) const;
  /// Linear between pixels; black outside.
  Image undistorted(const Image& image) const;

 private:
  int width_, height_;
  std::vector<float> columns_, rows_;  ///< where each pixel comes from; -1 = from outside
};

}  // namespace planar_mapping::io::layouts
