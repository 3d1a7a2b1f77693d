// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/io/atomic_file.h"

namespace planar_mapping {
namespace io {
namespace detail {

struct PngImage {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  int channels = 0;
  int bytes_per_channel = 1;
  std::vector<std::uint8_t> bytes;  ///< host byte order, no padding

  std::size_t rowSize() const {
    return std::size_t{width} * static_cast<std::size_t>(channels * bytes_per_channel);
  }
};

constexpr std::size_t kLargestImageFile = std::size_t{1} << 28;
constexpr std::uint32_t kLargestImageSide = 16384;

bool isPng(const std::vector<std::uint8_t>& bytes);
/// \param path   for messages
/// \param depth  gray of 16 bits, and nothing else will do; else one or three channels of 8 bits
/// \throws IoError
PngImage decodePng(const std::string& path, const std::vector<std::uint8_t>& bytes, bool depth);
/// \throws IoError, InputError if the image has no pixels, or others than its size says
void writePng(const std::string& path, PngImage& image, Overwrite overwrite);

}  // namespace detail
}  // namespace io
}  // namespace planar_mapping
