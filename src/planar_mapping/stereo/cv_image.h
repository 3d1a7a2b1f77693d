// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <opencv2/core.hpp>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/image_file.h"

namespace planar_mapping::detail {

/// The pixels of an image as OpenCV sees them, without a copy; nobody writes through it.
inline cv::Mat matOf(const io::Image& image) {
  return cv::Mat(image.height, image.width, CV_8UC(image.channels),
                 const_cast<std::uint8_t*>(image.pixels.data()));
}

inline std::string sizeText(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

/// \throws InputError unless both images are sound and of one size
inline void requirePair(const io::Image& left, const io::Image& right) {
  io::requireSound(left, "left");
  io::requireSound(right, "right");
  if (left.width != right.width || left.height != right.height) {
    throw InputError("the left image is " + sizeText(left.width, left.height) +
                     " pixels, the right one " + sizeText(right.width, right.height));
  }
}

/// \throws InputError unless the calibration is of a rectified pair of this size
inline void requireStereo(const io::Calibration& calibration, int width, int height) {
  if (calibration.unrectified) throw InputError("the pair has to be rectified first");
  if (!calibration.baseline) throw InputError("the calibration of a pair needs baseline_m");
  if (calibration.camera.width != width || calibration.camera.height != height) {
    throw InputError("the images are " + sizeText(width, height) + " pixels, their calibration " +
                     sizeText(calibration.camera.width, calibration.camera.height));
  }
}

class Stopwatch {
 public:
  /// Milliseconds since the last call, or since the beginning.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - start_).count();
    start_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace planar_mapping::detail
