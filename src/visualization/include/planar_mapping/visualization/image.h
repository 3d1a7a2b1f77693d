// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/visualization/colors.h"

namespace planar_mapping {

/// 8-bit RGB picture, rows from top to bottom.
struct PLANAR_MAPPING_EXPORT Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;  ///< 3 * width * height

  Image() = default;
  /// \throws ParameterError if a side is not in [1, 16384]
  Image(int columns, int rows, Color fill);
  Color at(int column, int row) const;
  void set(int column, int row, Color color);
};

/// Is every pixel within \p tolerance (of 255, per channel) of the first? A failed rendering is.
PLANAR_MAPPING_EXPORT bool isBlank(const Image& image, int tolerance = 3);

/// How two pictures of equal size differ.
struct ImageDifference {
  double mean = 0.0;     ///< mean absolute difference of all channel values, in [0, 1]
  double changed = 0.0;  ///< fraction of pixels with a channel more than 16 of 255 apart, in [0, 1]
};
/// \throws InputError if the sizes differ
PLANAR_MAPPING_EXPORT ImageDifference compareImages(const Image& a, const Image& b);

/// An image file as 8-bit RGB, as io::readImage() reads it.
/// \throws IoError
PLANAR_MAPPING_EXPORT Image readPng(const std::string& path);
/// Writes the file whole or not at all; the same picture gives the same bytes.
/// \throws IoError if it exists and \p overwrite is false, or cannot be written
PLANAR_MAPPING_EXPORT void writePng(const Image& image, const std::string& path, bool overwrite);

}  // namespace planar_mapping
