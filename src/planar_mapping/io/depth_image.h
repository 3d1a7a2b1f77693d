// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/cloud_file.h"

namespace planar_mapping::io {

/// One channel of 16 bits, row major.
struct DepthImage {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint16_t> values;  ///< 0 and 65535 = no measurement
};

/// \throws IoError unless the file is a sound gray PNG of 16 bits
PLANAR_MAPPING_EXPORT DepthImage readDepthPng(const std::string& path);
/// \throws IoError
PLANAR_MAPPING_EXPORT void writeDepthPng(const std::string& path, const DepthImage& image,
                                         Overwrite overwrite = Overwrite::Refuse);
/// Depth images of one camera to organized clouds in its optical frame (x right, y down, z
/// forward): z = value / depth_scale, x = (column - cx) z / fx, y = (row - cy) z / fy; 0 and
/// 65535 give NaN.
/// The rays are computed once. Const functions may be called from several threads at once.
class PLANAR_MAPPING_EXPORT DepthProjector {
 public:
  /// \throws ParameterError for a camera without size or focal length, or a scale <= 0
  /// \param along_ray  values are distances along the rays in place of z
  DepthProjector(const PinholeCamera& camera, double depth_scale, bool along_ray = false);

  /// Overwrites width, height and xyz of \p cloud and clears its other channels.
  /// \throws InputError if the image has another size than the camera
  void project(const DepthImage& image, CloudData& cloud) const;
  /// The same for depths as floats in the unit of depth_scale, row major, as many as the camera has
  /// pixels; 0, negative and not finite ones give NaN.
  void project(const float* values, CloudData& cloud) const;

 private:
  template <typename Value>
  void projectImage(const Value* values, CloudData& cloud) const;

  std::uint32_t width_;
  std::uint32_t height_;
  float metres_per_unit_;
  bool along_ray_;
  std::vector<float> column_slope_;
  std::vector<float> row_slope_;
};

}  // namespace planar_mapping::io
