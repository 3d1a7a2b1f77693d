// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A PNG, whose checksums are mended here, a JPEG, PGM or PPM.
#include "fuzz.h"
#include "planar_mapping/base/crc32.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/image_file.h"

using namespace planar_mapping;

namespace {

/// Chunks of a PNG: length, type, content, CRC-32 of type and content.
void mendChecksums(std::string& png) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(png.data());
  for (std::size_t at = 8; at + 12 <= png.size();) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = length << 8U | bytes[at + i];
    if (length > png.size() - at - 12) return;
    const std::uint32_t crc = detail::crc32(0, bytes + at + 4, length + 4);
    at += 12 + length;
    for (unsigned i = 0; i < 4; ++i) png[at - 4 + i] = static_cast<char>(crc >> (24 - 8 * i));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string bytes = fuzz::Input(data, size).rest();
  if (bytes.compare(0, 4, "\x89PNG") == 0) mendChecksums(bytes);
  const std::string path = fuzz::write("i.png", bytes);
  io::Image image;
  if (fuzz::succeeds([&] { image = io::readImage(path); })) {
    const auto width = static_cast<std::size_t>(image.width);
    const auto height = static_cast<std::size_t>(image.height);
    fuzz::require(image.pixels.size() == width * height * static_cast<std::size_t>(image.channels),
                  "as many pixels as the size says");
    const io::Image header = io::readImageSize(path);
    fuzz::require(header.width == image.width && header.height == image.height,
                  "the header says how large an image is");
    fuzz::require(io::toGray(image).pixels.size() == width * height, "gray pixels of all");
  }
  fuzz::succeeds([&] {
    const io::DepthImage depth = io::readDepthPng(path);
    fuzz::require(depth.values.size() == std::size_t{depth.width} * depth.height,
                  "as many depths as the size says");
  });
  return 0;
}
