// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/visualization/image.h"

#include <fcntl.h>
#include <png.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {

namespace {

constexpr int kLargestSide = 16384;

void requireSide(const char* name, int side) {
  requireInRange(name, side, 1, kLargestSide, "px");
}

// Every byte or an errno.
int writeAll(int file, const std::vector<std::uint8_t>& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::write(file, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return n < 0 ? errno : EIO;
    done += static_cast<std::size_t>(n);
  }
  return ::fsync(file) == 0 ? 0 : errno;
}

}  // namespace

Image::Image(int columns, int rows, Color fill) : width(columns), height(rows) {
  requireSide("image width", columns);
  requireSide("image height", rows);
  rgb.resize(3 * static_cast<std::size_t>(columns) * rows);
  for (std::size_t i = 0; i < rgb.size(); i += 3) {
    rgb[i] = fill.red;
    rgb[i + 1] = fill.green;
    rgb[i + 2] = fill.blue;
  }
}

Color Image::at(int column, int row) const {
  const std::uint8_t* p = rgb.data() + 3 * (static_cast<std::size_t>(row) * width + column);
  return {p[0], p[1], p[2]};
}

void Image::set(int column, int row, Color color) {
  std::uint8_t* p = rgb.data() + 3 * (static_cast<std::size_t>(row) * width + column);
  p[0] = color.red;
  p[1] = color.green;
  p[2] = color.blue;
}

bool isBlank(const Image& image, int tolerance) {
  for (std::size_t i = 3; i < image.rgb.size(); ++i) {
    if (std::abs(image.rgb[i] - image.rgb[i % 3]) > tolerance) return false;
  }
  return true;
}

ImageDifference compareImages(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height) {
    throw InputError("the pictures differ in size: " + std::to_string(a.width) + "x" +
                     std::to_string(a.height) + " and " + std::to_string(b.width) + "x" +
                     std::to_string(b.height));
  }
  ImageDifference difference;
  if (a.rgb.empty()) return difference;
  double sum = 0.0;
  std::size_t changed = 0;
  for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
    int largest = 0;
    for (std::size_t k = i; k < i + 3; ++k) {
      const int apart = std::abs(a.rgb[k] - b.rgb[k]);
      sum += apart;
      largest = std::max(largest, apart);
    }
    if (largest > 16) ++changed;
  }
  difference.mean = sum / (255.0 * static_cast<double>(a.rgb.size()));
  difference.changed = static_cast<double>(changed) / (static_cast<double>(a.rgb.size()) / 3.0);
  return difference;
}

std::vector<std::uint8_t> encodePng(const Image& image) {
  requireSide("image width", image.width);
  requireSide("image height", image.height);
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::vector<std::uint8_t> bytes(size);
  if (png_image_write_to_memory(&header, bytes.data(), &size, 0, image.rgb.data(), 0, nullptr) ==
      0) {
    throw RenderError(std::string("the picture cannot be written as PNG: ") + header.message);
  }
  bytes.resize(size);
  return bytes;
}

Image readPng(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) throw IoError(path, std::strerror(errno));
  if (!S_ISREG(status.st_mode)) throw IoError(path, "is not a file");
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  // png_image_free() by itself: every way out has to pass it.
  const std::unique_ptr<png_image, decltype(&png_image_free)> guard(&header, png_image_free);
  if (png_image_begin_read_from_file(&header, path.c_str()) == 0) {
    throw IoError(path, std::string("cannot be read as a PNG picture: ") + header.message);
  }
  if (header.width > kLargestSide || header.height > kLargestSide) {
    throw IoError(path, "is larger than 16384 x 16384 pixels");
  }
  header.format = PNG_FORMAT_RGB;
  Image image(static_cast<int>(header.width), static_cast<int>(header.height), Color{});
  const png_color white = {255, 255, 255};
  if (png_image_finish_read(&header, &white, image.rgb.data(), 0, nullptr) == 0) {
    throw IoError(path, std::string("cannot be read as a PNG picture: ") + header.message);
  }
  return image;
}

void requireWritablePng(const std::string& path, bool overwrite) {
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) throw IoError(path, "is a directory");
    if (!overwrite) {
      throw IoError(path, "exists already and is not overwritten (--force overwrites)");
    }
    return;
  }
  const std::size_t slash = path.rfind('/');
  const std::string folder =
      slash == std::string::npos ? "." : path.substr(0, std::max<std::size_t>(slash, 1));
  if (::access(folder.c_str(), W_OK) != 0) {
    throw IoError(path, "cannot be written: " + folder + ": " + std::strerror(errno));
  }
}

void writePng(const Image& image, const std::string& path, bool overwrite) {
  requireWritablePng(path, overwrite);
  const std::vector<std::uint8_t> bytes = encodePng(image);
  const std::string temporary = path + ".tmp" + std::to_string(::getpid());
  const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0) throw IoError(path, std::string("cannot be written: ") + std::strerror(errno));
  int problem = writeAll(file, bytes);
  if (::close(file) != 0 && problem == 0) problem = errno;
  if (problem == 0 && ::rename(temporary.c_str(), path.c_str()) != 0) problem = errno;
  if (problem != 0) {
    ::unlink(temporary.c_str());
    throw IoError(path, std::string("cannot be written: ") + std::strerror(problem));
  }
}

}  // namespace planar_mapping
