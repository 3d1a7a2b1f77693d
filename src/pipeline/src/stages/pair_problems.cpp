// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "pair_problems.h"

#include "planar_mapping/core/base/error.h"
#include "rounded.h"

namespace planar_mapping::detail {

std::string problemOf(const FrameImages& images) {
  const io::Image& left = images.left;
  const io::Image& right = images.right;
  if (left.empty() && right.empty()) {
    throw InputError(
        "the input has no image pairs, which stereo_matching needs; take it out of "
        "the configuration for inputs that bring depth or clouds");
  }
  if (!images.calibration) throw InputError("an image pair needs a calib.yaml");
  if (left.empty() || right.empty())
    return std::string("there is no ") + (left.empty() ? "left" : "right") + " image";
  const auto size = [](const io::Image& image) {
    return std::to_string(image.width) + " x " + std::to_string(image.height);
  };
  if (size(left) == size(right)) return "";
  return "the left image is " + size(left) + " pixels, the right one " + size(right);
}

std::string problemOf(const StereoReport& report, double min_brightness, double min_density) {
  if (report.brightness < min_brightness) {
    return "the left image is black: its mean gray value is " + rounded(report.brightness, 1) +
           " of 255";
  }
  if (report.swapped) return "left and right images seem to be exchanged: disparities are negative";
  if (report.density >= min_density) return "";
  return "only " + rounded(100.0 * report.density, 1) +
         " % of the pixels have a disparity: there is no texture, or left and right do not belong "
         "together (neighbouring pixels differ by " +
         rounded(report.contrast, 1) + " gray values on average)";
}

}  // namespace planar_mapping::detail
