// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <png.h>

#include <cstring>
#include <functional>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/io/depth_image.h"
#include "png_codec.h"

namespace planar_mapping {
namespace io {
namespace {

using detail::PngImage;

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
  png_set_user_limits(png, detail::kLargestImageSide, detail::kLargestImageSide);
  png_read_info(png, info);
  image.width = png_get_image_width(png, info);
  image.height = png_get_image_height(png, info);
  const int bits = png_get_bit_depth(png, info);
  const int type = png_get_color_type(png, info);
  image.channels = !depth && (type & PNG_COLOR_MASK_COLOR) != 0 ? 3 : 1;
  image.bytes_per_channel = depth ? 2 : 1;
  if (depth) {
    if (bits != 16 || type != PNG_COLOR_TYPE_GRAY) png_error(png, "not gray of 16 bits");
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

}  // namespace

namespace detail {

bool isPng(const std::vector<std::uint8_t>& bytes) {
  return bytes.size() >= 8 && png_sig_cmp(bytes.data(), 0, 8) == 0;
}

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

void writePng(const std::string& path, PngImage& image, Overwrite overwrite) {
  if (image.bytes.empty() || image.bytes.size() != image.rowSize() * image.height)
    throw InputError(
        "an image without pixels, or with others than its size says, cannot be written to " + path);
  AtomicFile file(path, overwrite);
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
  if (!sound) throw IoError(path, "cannot be encoded: " + context.problem);
  file.write(context.output.data(), context.output.size());
  file.commit();
}

}  // namespace detail

DepthImage readDepthPng(const std::string& path) {
  const PngImage image =
      detail::decodePng(path, readWholeFile(path, detail::kLargestImageFile), true);
  DepthImage depth;
  depth.width = image.width;
  depth.height = image.height;
  depth.values.resize(image.bytes.size() / 2);
  std::memcpy(depth.values.data(), image.bytes.data(), image.bytes.size());
  return depth;
}

void writeDepthPng(const std::string& path, const DepthImage& depth, Overwrite overwrite) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(depth.values.data());
  PngImage image{depth.width, depth.height, 1, 2, {bytes, bytes + 2 * depth.values.size()}};
  detail::writePng(path, image, overwrite);
}

}  // namespace io
}  // namespace planar_mapping
