// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/image_file.h"

#include <turbojpeg.h>

#include <memory>

#include "planar_mapping/core/base/error.h"
#include "png_codec.h"

namespace planar_mapping {
namespace io {
namespace {

using detail::PngImage;

struct CloseDecoder {
  void operator()(void* decoder) const { tjDestroy(decoder); }
};
using Decoder = std::unique_ptr<void, CloseDecoder>;

bool isJpeg(const std::vector<std::uint8_t>& bytes) {
  return bytes.size() >= 3 && bytes[0] == 0xFF && bytes[1] == 0xD8 && bytes[2] == 0xFF;
}

Image decodeJpeg(const std::string& path, const std::vector<std::uint8_t>& bytes,
                 bool header_only) {
  const Decoder decoder(tjInitDecompress());
  if (!decoder) throw IoError(path, "cannot be decoded: no memory");
  const auto fail = [&]() {
    throw IoError(path, std::string("is no usable JPEG image: ") + tjGetErrorStr2(decoder.get()));
  };
  const auto size = static_cast<unsigned long>(bytes.size());
  Image image;
  int subsampling = 0;
  int color_space = 0;
  if (tjDecompressHeader3(decoder.get(), bytes.data(), size, &image.width, &image.height,
                          &subsampling, &color_space) != 0)
    fail();
  constexpr int kLargest = static_cast<int>(detail::kLargestImageSide);
  if (image.width > kLargest || image.height > kLargest)
    throw IoError(path, "is no usable JPEG image: more than 16384 pixels a side");
  if (header_only) return image;
  const std::size_t pixels =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  // A block of 64 pixels takes one bit at the very least.
  if (pixels / 1024 > bytes.size()) throw IoError(path, "is no usable JPEG image: cut short");
  const bool gray = color_space == TJCS_GRAY;
  image.channels = gray ? 1 : 3;
  image.pixels.resize(pixels * static_cast<std::size_t>(image.channels));
  // A file that was cut short is only worth a warning to the decoder.
  if (tjDecompress2(decoder.get(), bytes.data(), size, image.pixels.data(), image.width, 0,
                    image.height, gray ? TJPF_GRAY : TJPF_RGB,
                    TJFLAG_STOPONWARNING | TJFLAG_ACCURATEDCT) != 0)
    fail();
  return image;
}

}  // namespace

Image readImage(const std::string& path) {
  const std::vector<std::uint8_t> bytes = readWholeFile(path, detail::kLargestImageFile);
  if (isJpeg(bytes)) return decodeJpeg(path, bytes, false);
  if (!detail::isPng(bytes)) throw IoError(path, "is neither a PNG nor a JPEG image");
  PngImage png = detail::decodePng(path, bytes, false);
  return {static_cast<int>(png.width), static_cast<int>(png.height), png.channels,
          std::move(png.bytes)};
}

Image readImageSize(const std::string& path) {
  const std::vector<std::uint8_t> bytes = readWholeFile(path, detail::kLargestImageFile);
  if (isJpeg(bytes)) return decodeJpeg(path, bytes, true);
  constexpr std::size_t kHeader = 24;  // signature, length and type of IHDR, width, height
  if (!detail::isPng(bytes) || bytes.size() < kHeader)
    throw IoError(path, "is neither a PNG nor a JPEG image");
  const auto side = [&bytes](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = at; i < at + 4; ++i) value = value << 8u | bytes[i];
    return value;
  };
  if (side(16) - 1 >= detail::kLargestImageSide || side(20) - 1 >= detail::kLargestImageSide)
    throw IoError(path, "is no usable PNG image: no pixels, or more than 16384 a side");
  Image image;
  image.width = static_cast<int>(side(16));
  image.height = static_cast<int>(side(20));
  return image;
}

void writeImage(const std::string& path, const Image& image, Overwrite overwrite) {
  if (image.width <= 0 || image.height <= 0 || (image.channels != 1 && image.channels != 3))
    throw InputError(
        "an image of no size, or of other than 1 or 3 channels, cannot be written to " + path);
  PngImage png{static_cast<std::uint32_t>(image.width), static_cast<std::uint32_t>(image.height),
               image.channels, 1, image.pixels};
  detail::writePng(path, png, overwrite);
}

Image toGray(const Image& image) {
  if (image.channels != 3) return image;
  Image gray;
  gray.width = image.width;
  gray.height = image.height;
  gray.channels = 1;
  gray.pixels.resize(image.pixels.size() / 3);
  const std::uint8_t* rgb = image.pixels.data();
  // 0.299, 0.587, 0.114 in units of 2^-16.
  for (std::uint8_t& value : gray.pixels) {
    value = static_cast<std::uint8_t>(
        (19595u * rgb[0] + 38470u * rgb[1] + 7471u * rgb[2] + 32768u) >> 16u);
    rgb += 3;
  }
  return gray;
}

}  // namespace io
}  // namespace planar_mapping
