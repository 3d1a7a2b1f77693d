// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/io/image_file.h"

namespace planar_mapping::detail {

/// [ours] Finds out whether a depth camera's colour image is registered to its depth, that is,
/// shows at each pixel what has the depth of that pixel. Depth images as some cameras and data sets
/// deliver them are not: the colour camera is beside the other and sees another angle. Then the
/// edges of the depth meet edges of the image only where they are scaled and shifted.
class PLANAR_MAPPING_EXPORT ColourRegistration {
 public:
  enum class State : std::uint8_t { Unknown, Registered, Apart };

  /// \param image  of the size of the cloud
  /// \param cloud  organized, in the camera's frame
  void look(const io::Image& image, const PointsView& cloud);
  /// Of all frames so far, thirty at most. Once it is known it stays.
  State state() const { return state_; }
  /// Whether edges enough for an answer meet none of the image where they are, nor most of it near.
  bool isDoubtful() const { return state_ == State::Unknown && meets_nothing_; }
  /// Whether it is doubtful after all the frames that are looked at.
  bool isGivenUp() const { return isDoubtful() && frames_ >= kMaxFrames; }
  /// The image as it would be at the pixels of the depth image, but for the distance between the
  /// cameras: right to a few pixels. Of State::Apart.
  io::Image aligned(const io::Image& image) const;
  /// How things in the colour image differ from those in the depth image, in words.
  std::string describe() const;

 private:
  static constexpr int kMaxFrames = 30;  ///< that are looked at

  void decide();

  State state_ = State::Unknown;
  bool meets_nothing_ = false;
  std::int32_t frames_ = 0;
  /// Contrast of the image at the edges of each half, by scale, column and row of the shift.
  std::array<std::vector<double>, 2> sums_;
  std::array<std::int64_t, 2> counts_ = {0, 0};
  double scale_ = 1.0;         ///< about the middle of the image
  double column_shift_ = 0.0;  ///< in widths of the image
  double row_shift_ = 0.0;
};

}  // namespace planar_mapping::detail
