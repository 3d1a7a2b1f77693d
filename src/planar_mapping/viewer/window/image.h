// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "planar_mapping/base/export.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/viewer/scene/colors.h"

namespace planar_mapping {

/// A picture: always RGB.
using Image = io::Image;

PLANAR_MAPPING_EXPORT Color colorAt(const Image& image, int column, int row);

/// Is every pixel within \p tolerance (of 255, per channel) of the first? A failed rendering is.
PLANAR_MAPPING_EXPORT bool isBlank(const Image& image, int tolerance = 3);

/// How two pictures of equal size differ.
struct ImageDifference {
  double mean = 0.0;     ///< mean absolute difference of all channel values, in [0, 1]
  double changed = 0.0;  ///< fraction of pixels with a channel more than 16 of 255 apart, in [0, 1]
};
/// \throws InputError if the sizes differ
PLANAR_MAPPING_EXPORT ImageDifference compareImages(const Image& a, const Image& b);

/// An image file, a gray one too, as a picture; io::writeImage() writes them.
/// \throws IoError
PLANAR_MAPPING_EXPORT Image readPng(const std::string& path);

}  // namespace planar_mapping
