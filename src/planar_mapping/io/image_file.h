// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/io/atomic_file.h"

namespace planar_mapping::io {

/// An 8-bit image, gray or RGB, row by row from the top without padding.
struct Image {
  int width = 0;     ///< pixels
  int height = 0;    ///< pixels
  int channels = 0;  ///< 1 = gray, 3 = red, green, blue
  std::vector<std::uint8_t> pixels;

  bool empty() const { return pixels.empty(); }
};

/// \throws InputError unless the \p name image is gray or RGB and has pixels, as many as its size
///     says
PLANAR_MAPPING_EXPORT void requireSound(const Image& image, const std::string& name);

/// Reads a PNG, JPEG, PGM or PPM image, recognised by content; 16 bits of a PNG become 8 (a PGM
/// or PPM must have 8), alpha is dropped, palettes are resolved.
/// \throws IoError naming the path: missing, not an image, truncated, damaged, beyond 16384 pixels
///         a side
PLANAR_MAPPING_EXPORT Image readImage(const std::string& path);

/// Width and height by the header of an image, which is not decoded. channels and pixels stay
/// empty.
/// \throws IoError as readImage()
PLANAR_MAPPING_EXPORT Image readImageSize(const std::string& path);

/// Writes a PNG image, atomically.
/// \throws IoError, InputError if sizes disagree
PLANAR_MAPPING_EXPORT void writeImage(const std::string& path, const Image& image,
                                      Overwrite overwrite = Overwrite::Refuse);

/// The bytes of a PNG file.
/// \throws InputError as writeImage()
PLANAR_MAPPING_EXPORT std::vector<std::uint8_t> encodePng(const Image& image);

/// Luminance (BT.601) of an image; one that is not RGB is returned as it is.
/// \throws InputError if sizes disagree
PLANAR_MAPPING_EXPORT Image toGray(const Image& image);

/// The image at another size: each pixel is the mean of what it covers of the old ones. Enlarged,
/// old pixels become blocks.
/// \param width, height  pixels, > 0
/// \throws InputError for an empty image, or if sizes disagree
PLANAR_MAPPING_EXPORT Image scaledTo(const Image& image, int width, int height);

}  // namespace planar_mapping::io
