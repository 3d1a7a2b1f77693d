// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/image_file.h"

#include <png.h>
#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <memory>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/depth_image.h"

namespace planar_mapping::io {
namespace {

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

constexpr const char* kNoImage = "is no PNG, JPEG, PGM or PPM image";
constexpr std::size_t kLargestImageFile = std::size_t{1} << 28;
constexpr std::uint32_t kLargestImageSide = 16384;

/// What libpng's callbacks need. Errors leave the library by longjmp; the functions that set the
/// jump hold nothing that needs a destructor, and throw only after they have returned.
struct Context {
  std::string problem;
  const std::vector<std::uint8_t>* input = nullptr;
  std::size_t position = 0;
  std::vector<std::uint8_t> output;
};

void onError(png_structp png, png_const_charp message) {
  static_cast<Context*>(png_get_error_ptr(png))->problem = message;
  png_longjmp(png, 1);
}

void onWarning(png_structp, png_const_charp) {}

void onRead(png_structp png, png_bytep data, png_size_t size) {
  auto* context = static_cast<Context*>(png_get_io_ptr(png));
  if (size > context->input->size() - context->position) png_error(png, "cut short");
  std::memcpy(data, context->input->data() + context->position, size);
  context->position += size;
}

void onWrite(png_structp png, png_bytep data, png_size_t size) {
  auto* context = static_cast<Context*>(png_get_io_ptr(png));
  context->output.insert(context->output.end(), data, data + size);
}

void onFlush(png_structp) {}

bool decodeHeader(png_structp png, png_infop info, bool depth, PngImage& image) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_user_limits(png, kLargestImageSide, kLargestImageSide);
  png_read_info(png, info);
  image.width = png_get_image_width(png, info);
  image.height = png_get_image_height(png, info);
  const int bits = png_get_bit_depth(png, info);
  const int type = png_get_color_type(png, info);
  image.channels = !depth && (type & PNG_COLOR_MASK_COLOR) != 0 ? 3 : 1;
  image.bytes_per_channel = depth ? 2 : 1;
  if (depth) {
    if (bits != 16 || type != PNG_COLOR_TYPE_GRAY)
      png_error(png, "not gray of 16 bits, as depth is");
    png_set_swap(png);
  } else {
    png_set_expand(png);
    png_set_scale_16(png);
    png_set_strip_alpha(png);
  }
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  if (png_get_rowbytes(png, info) != image.rowSize()) png_error(png, "odd row size");
  return true;
}

bool decodeRows(png_structp png, png_bytepp rows) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_read_image(png, rows);
  png_read_end(png, nullptr);
  return true;
}

bool encode(png_structp png, png_infop info, const PngImage& image, png_bytepp rows) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_IHDR(png, info, image.width, image.height, 8 * image.bytes_per_channel,
               image.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  if (image.bytes_per_channel == 2) png_set_swap(png);
  png_write_image(png, rows);
  png_write_end(png, nullptr);
  return true;
}

bool isPng(const std::vector<std::uint8_t>& bytes) {
  return bytes.size() >= 8 && png_sig_cmp(bytes.data(), 0, 8) == 0;
}

/// \param path   for messages
/// \param depth  gray of 16 bits, and nothing else will do; else one or three channels of 8 bits
/// \throws IoError
PngImage decodePng(const std::string& path, const std::vector<std::uint8_t>& bytes, bool depth) {
  if (!isPng(bytes)) throw IoError(path, "is no PNG image");
  Context context;
  context.input = &bytes;
  PngImage image;
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &context, onError, onWarning);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  if (info == nullptr) {
    png_destroy_read_struct(&png, nullptr, nullptr);
    throw IoError(path, "cannot be decoded: no memory");
  }
  png_set_read_fn(png, &context, onRead);
  bool sound = decodeHeader(png, info, depth, image);
  if (sound) {
    const std::size_t row_size = image.rowSize();
    // A row of an empty image packs to no less than a thousandth (deflate's limit is 1 : 1032).
    if (row_size * image.height / 2048 > bytes.size()) {
      sound = false;
      context.problem = "cut short";
    } else {
      image.bytes.resize(row_size * image.height);
      std::vector<png_bytep> rows(image.height);
      for (std::size_t row = 0; row < rows.size(); ++row)
        rows[row] = image.bytes.data() + row * row_size;
      sound = decodeRows(png, rows.data());
    }
  }
  png_destroy_read_struct(&png, &info, nullptr);
  if (!sound) throw IoError(path, "is no usable PNG image: " + context.problem);
  return image;
}

/// \param name  of the image, in messages
/// \throws IoError, InputError if the image has no pixels, or others than its size says
std::vector<std::uint8_t> pngOf(PngImage& image, const std::string& name) {
  if (image.bytes.empty() || image.bytes.size() != image.rowSize() * image.height)
    throw InputError(
        "an image without pixels, or with others than its size says, cannot be written to " + name);
  Context context;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &context, onError, onWarning);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  bool sound = false;
  if (info != nullptr) {
    png_set_write_fn(png, &context, onWrite, onFlush);
    std::vector<png_bytep> rows(image.height);
    for (std::size_t row = 0; row < rows.size(); ++row)
      rows[row] = image.bytes.data() + row * image.rowSize();
    sound = encode(png, info, image, rows.data());
  }
  png_destroy_write_struct(&png, &info);
  if (!sound) throw IoError(name, "cannot be encoded: " + context.problem);
  return std::move(context.output);
}

void writePng(const std::string& path, PngImage& image, Overwrite overwrite) {
  const std::vector<std::uint8_t> bytes = pngOf(image, path);
  AtomicFile file(path, overwrite);
  file.write(bytes.data(), bytes.size());
  file.commit();
}

/// \throws InputError for an image without size or of other than 1 or 3 channels
PngImage pngImageOf(const Image& image, const std::string& name) {
  if (image.width <= 0 || image.height <= 0 || (image.channels != 1 && image.channels != 3))
    throw InputError(
        "an image of no size, or of other than 1 or 3 channels, cannot be written to " + name);
  return {static_cast<std::uint32_t>(image.width), static_cast<std::uint32_t>(image.height),
          image.channels, 1, image.pixels};
}

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
  constexpr int kLargest = static_cast<int>(kLargestImageSide);
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

bool isPnm(const std::vector<std::uint8_t>& bytes) {
  return bytes.size() > 2 && bytes[0] == 'P' && (bytes[1] == '5' || bytes[1] == '6') &&
         (std::isspace(bytes[2]) != 0 || bytes[2] == '#');
}

/// Binary PGM or PPM of 8 bits.
Image decodePnm(const std::string& path, const std::vector<std::uint8_t>& bytes, bool header_only) {
  const auto fail = [&](const std::string& why) {
    throw IoError(path, "is no usable PGM or PPM image: " + why);
  };
  std::size_t at = 2;
  std::array<std::uint32_t, 3> numbers{};  // width, height, the largest value
  for (std::uint32_t& number : numbers) {
    while (at < bytes.size() && (std::isspace(bytes[at]) != 0 || bytes[at] == '#')) {
      if (bytes[at] == '#')
        while (at < bytes.size() && bytes[at] != '\n') ++at;
      else
        ++at;
    }
    while (at < bytes.size() && std::isdigit(bytes[at]) != 0 && number <= kLargestImageSide)
      number = 10 * number + (bytes[at++] - std::uint32_t{'0'});
  }
  const auto [width, height, largest] = numbers;
  if (width == 0 || height == 0 || width > kLargestImageSide || height > kLargestImageSide)
    fail("no pixels, or more than 16384 a side");
  if (largest == 0 || largest > 255) fail("not 8 bits, or no header");
  if (at >= bytes.size() || std::isspace(bytes[at]) == 0) fail("its header is cut short");
  ++at;  // one blank ends the header
  Image image{static_cast<int>(width), static_cast<int>(height), 0, {}};
  if (header_only) return image;
  image.channels = bytes[1] == '6' ? 3 : 1;
  const std::size_t size = std::size_t{width} * height * static_cast<std::size_t>(image.channels);
  if (at > bytes.size() || bytes.size() - at < size) fail("cut short");
  const auto first = bytes.begin() + static_cast<std::ptrdiff_t>(at);
  image.pixels.assign(first, first + static_cast<std::ptrdiff_t>(size));
  if (largest < 255) {
    for (std::uint8_t& value : image.pixels)
      value = static_cast<std::uint8_t>(std::min(255u, value * 255u / largest));
  }
  return image;
}

/// What a new pixel covers of an old one, along one side.
struct Overlap {
  int from, to;  ///< old, new
  float part;    ///< fraction of the new one
};

std::vector<Overlap> overlapsOf(int from, int to) {
  std::vector<Overlap> overlaps;
  const double step = static_cast<double>(from) / to;
  for (int i = 0; i < to; ++i) {
    const double begin = i * step;
    const double end = std::min((i + 1) * step, static_cast<double>(from));
    for (int k = static_cast<int>(begin); k < from && k < end; ++k) {
      const double covered = std::min(k + 1.0, end) - std::max<double>(k, begin);
      overlaps.push_back({k, i, static_cast<float>(covered / (end - begin))});
    }
  }
  return overlaps;
}

}  // namespace

Image readImage(const std::string& path) {
  const std::vector<std::uint8_t> bytes = readWholeFile(path, kLargestImageFile);
  if (isJpeg(bytes)) return decodeJpeg(path, bytes, false);
  if (isPnm(bytes)) return decodePnm(path, bytes, false);
  if (!isPng(bytes)) throw IoError(path, kNoImage);
  PngImage png = decodePng(path, bytes, false);
  return {static_cast<int>(png.width), static_cast<int>(png.height), png.channels,
          std::move(png.bytes)};
}

Image readImageSize(const std::string& path) {
  const std::vector<std::uint8_t> bytes = readWholeFile(path, kLargestImageFile);
  if (isJpeg(bytes)) return decodeJpeg(path, bytes, true);
  if (isPnm(bytes)) return decodePnm(path, bytes, true);
  constexpr std::size_t kHeader = 24;  // signature, length and type of IHDR, width, height
  if (!isPng(bytes) || bytes.size() < kHeader) throw IoError(path, kNoImage);
  const auto side = [&bytes](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = at; i < at + 4; ++i) value = value << 8u | bytes[i];
    return value;
  };
  if (side(16) - 1 >= kLargestImageSide || side(20) - 1 >= kLargestImageSide)
    throw IoError(path, "is no usable PNG image: no pixels, or more than 16384 a side");
  return {static_cast<int>(side(16)), static_cast<int>(side(20)), 0, {}};
}

void writeImage(const std::string& path, const Image& image, Overwrite overwrite) {
  PngImage png = pngImageOf(image, path);
  writePng(path, png, overwrite);
}

std::vector<std::uint8_t> encodePng(const Image& image) {
  const std::string name = "a PNG image";
  PngImage png = pngImageOf(image, name);
  return pngOf(png, name);
}

DepthImage readDepthPng(const std::string& path) {
  const PngImage image = decodePng(path, readWholeFile(path, kLargestImageFile), true);
  DepthImage depth{image.width, image.height, std::vector<std::uint16_t>(image.bytes.size() / 2)};
  std::memcpy(depth.values.data(), image.bytes.data(), image.bytes.size());
  return depth;
}

void writeDepthPng(const std::string& path, const DepthImage& depth, Overwrite overwrite) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(depth.values.data());
  PngImage image{depth.width, depth.height, 1, 2, {bytes, bytes + 2 * depth.values.size()}};
  writePng(path, image, overwrite);
}

void requireSound(const Image& image, const std::string& name) {
  const bool sound = image.width > 0 && image.height > 0 &&
                     (image.channels == 1 || image.channels == 3) &&
                     image.pixels.size() == static_cast<std::size_t>(image.width) *
                                                static_cast<std::size_t>(image.height) *
                                                static_cast<std::size_t>(image.channels);
  if (!sound) throw InputError("the " + name + " image has no pixels or others than its size says");
}

Image toGray(const Image& image) {
  if (image.channels != 3) return image;
  requireSound(image, "colour");
  Image gray{image.width, image.height, 1, std::vector<std::uint8_t>(image.pixels.size() / 3)};
  const std::uint8_t* rgb = image.pixels.data();
  // 0.299, 0.587, 0.114 in units of 2^-16.
  for (std::uint8_t& value : gray.pixels) {
    value = static_cast<std::uint8_t>(
        (19595u * rgb[0] + 38470u * rgb[1] + 7471u * rgb[2] + 32768u) >> 16u);
    rgb += 3;
  }
  return gray;
}

Image scaledTo(const Image& image, int width, int height) {
  requireSound(image, "old");
  if (width <= 0 || height <= 0) throw InputError("an image cannot be scaled to no pixels");
  const int channels = image.channels;
  const auto sizeOf = [channels](int columns, int rows) {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows * channels);
  };
  std::vector<float> rows(sizeOf(image.width, height), 0.0f);  // of the new height
  for (const Overlap& one : overlapsOf(image.height, height)) {
    const std::uint8_t* in = &image.pixels[sizeOf(image.width, one.from)];
    float* out = &rows[sizeOf(image.width, one.to)];
    for (int i = 0; i < image.width * channels; ++i) out[i] += one.part * in[i];
  }
  const std::vector<Overlap> columns = overlapsOf(image.width, width);
  Image scaled{width, height, channels, std::vector<std::uint8_t>(sizeOf(width, height))};
  std::vector<float> line(sizeOf(width, 1));
  for (int row = 0; row < height; ++row) {
    std::fill(line.begin(), line.end(), 0.5f);
    const float* in = &rows[sizeOf(image.width, row)];
    for (const Overlap& one : columns)
      for (int c = 0; c < channels; ++c)
        line[static_cast<std::size_t>(one.to * channels + c)] +=
            one.part * in[one.from * channels + c];
    std::transform(line.begin(), line.end(), &scaled.pixels[sizeOf(width, row)],
                   [](float value) { return static_cast<std::uint8_t>(std::min(value, 255.0f)); });
  }
  return scaled;
}

}  // namespace planar_mapping::io
