// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/cloud_layout.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>

#include "planar_mapping/base/error.h"

namespace planar_mapping::io {
namespace {

/// Bytes of a point; more is no point.
constexpr std::uint64_t kLargestRecord = std::uint64_t{1} << 28;
/// Indices are ints.
constexpr std::uint64_t kMaxPoints = std::numeric_limits<int>::max();
/// Bytes that are read at once.
constexpr std::size_t kBlock = std::size_t{1} << 20;

double loadNumber(const std::uint8_t* bytes, ScalarType type, bool big_endian) {
  const std::uint64_t bits = loadBits(bytes, type.size, big_endian);
  if (type.kind == 'U') return static_cast<double>(bits);
  if (type.kind == 'I') {
    const unsigned unused = 64u - 8u * type.size;  // shifted out and in again: the sign fills them
    return static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused);
  }
  float narrow;
  double wide;
  std::memcpy(&narrow, &bits, sizeof narrow);
  std::memcpy(&wide, &bits, sizeof wide);
  return type.size == 4 ? static_cast<double>(narrow) : wide;
}

/// The cast alone is undefined beyond the range of float.
float toFloat(double value) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  if (value > kLargest) return std::numeric_limits<float>::infinity();
  if (value < -kLargest) return -std::numeric_limits<float>::infinity();
  return static_cast<float>(value);
}

std::uint32_t toLabel(double value) {
  return value >= 0.0 && value < 4294967296.0 ? static_cast<std::uint32_t>(value) : 0u;
}

/// Colours in text: PCL has written them as the float whose bits they are, as that number's
/// integer value, and as an integer.
std::uint32_t colorOfNumber(double value, bool is_float) {
  if (!is_float || value >= 1.0) return toLabel(value) & 0xFFFFFFu;
  const float narrow = toFloat(value);
  std::uint32_t bits;
  std::memcpy(&bits, &narrow, sizeof bits);
  return bits & 0xFFFFFFu;
}

/// The first measurement decides whether its digits need one. \param origin  NaN before
void chooseOrigin(double value, double& origin) {
  constexpr double kNear = 1000.0;  // metres: a float is exact to 0.1 mm there
  constexpr double kFarthest = 1e12;
  if (!std::isnan(origin) || !std::isfinite(value)) return;
  const double distance = std::abs(value);
  origin = distance > kNear && distance < kFarthest ? std::round(value) : 0.0;
}

}  // namespace

std::uint64_t loadBits(const std::uint8_t* bytes, std::size_t size, bool big_endian) {
  std::uint64_t bits = 0;
  if (!big_endian) std::memcpy(&bits, bytes, size);
  for (std::size_t i = 0; big_endian && i < size; ++i) bits = bits << 8u | bytes[i];
  return bits;
}

CloudFiller::CloudFiller(const std::string& path, const std::vector<CloudField>& fields,
                         const CloudChannels& channels)
    : path_(path) {
  for (CloudField field : fields) {
    field.offset = record_size_;
    field.word = words_;
    if (field.count > kLargestRecord) throw IoError(path, "a point has too many values");
    record_size_ += field.count * field.type.size;
    words_ += field.count;
    if (record_size_ > kLargestRecord) throw IoError(path, "a point has too many values");
    addColumn(field, channels);
  }
  for (const auto& [target, name] :
       {std::pair(Target::X, "x"), std::pair(Target::Y, "y"), std::pair(Target::Z, "z")}) {
    if (countOf(target) == 0) throw IoError(path, std::string("has no field '") + name + "'");
    if (countOf(target) > 1) throw IoError(path, std::string("has the field '") + name + "' twice");
  }
  // A lone channel of three makes no colour.
  if (countOf(Target::Red) != 1 || countOf(Target::Green) != 1 || countOf(Target::Blue) != 1 ||
      countOf(Target::PackedColor) > 0) {
    columns_.erase(std::remove_if(columns_.begin(), columns_.end(),
                                  [](const Column& c) {
                                    return c.target == Target::Red || c.target == Target::Green ||
                                           c.target == Target::Blue;
                                  }),
                   columns_.end());
  }
}

void CloudFiller::addColumn(const CloudField& field, const CloudChannels& channels) {
  struct Name {
    const char* name;
    Target target;
  };
  static constexpr Name kNames[] = {
      {"x", Target::X},
      {"y", Target::Y},
      {"z", Target::Z},
      {"rgb", Target::PackedColor},
      {"rgba", Target::PackedColor},
      {"red", Target::Red},
      {"green", Target::Green},
      {"blue", Target::Blue},
      {"diffuse_red", Target::Red},
      {"diffuse_green", Target::Green},
      {"diffuse_blue", Target::Blue},
      {"label", Target::Label},
      {"scalar_label", Target::Label},
      {"intensity", Target::Intensity},
      {"scalar_intensity", Target::Intensity},
  };
  std::string lower = field.name;  // PDAL writes X, Y and Z
  for (char& letter : lower) letter = static_cast<char>(std::tolower(letter));
  const auto* const known = std::find_if(std::begin(kNames), std::end(kNames),
                                         [&lower](const Name& name) { return lower == name.name; });
  if (known == std::end(kNames) || field.count == 0) return;
  const Target target = known->target;
  if (target == Target::X || target == Target::Y || target == Target::Z) {
    if (!field.type.isFloat() || field.count != 1)
      throw IoError(path_, "field '" + field.name + "' is of type " + field.type.kind +
                               std::to_string(field.type.size) +
                               (field.count != 1 ? " x " + std::to_string(field.count) : "") +
                               "; x, y and z must be single F4 or F8 values");
  } else {
    const bool wanted = target == Target::Label       ? channels.labels
                        : target == Target::Intensity ? channels.intensities
                                                      : channels.colors;
    const bool usable = target == Target::PackedColor ? field.type.size == 4
                        : target == Target::Label || target == Target::Intensity
                            ? true
                            : field.type == ScalarType{'U', 1};
    if (!wanted || !usable || field.count != 1 || countOf(target) > 0) return;
  }
  columns_.push_back({target, field});
}

std::ptrdiff_t CloudFiller::countOf(Target target) const {
  return std::count_if(columns_.begin(), columns_.end(),
                       [target](const Column& column) { return column.target == target; });
}

void CloudFiller::checkSize(const CloudHeader& header, std::uint64_t bytes_left) const {
  const auto [width, height] = std::pair(header.width, header.height);
  if (width == 0 || height == 0) throw IoError(path_, "holds no points");
  if (width > kMaxPoints || height > kMaxPoints / width)
    throw IoError(path_, "announces " + std::to_string(width) + " x " + std::to_string(height) +
                             " points, more than can be handled");
  const std::uint64_t points = width * height;
  // In text a value takes a character and a separator at least; the last separator may be missing.
  const bool ascii = header.isAscii();
  const std::uint64_t smallest = ascii ? 2 * static_cast<std::uint64_t>(words_) : record_size_;
  if (points > (bytes_left + (ascii ? 1 : 0)) / smallest)
    throw IoError(path_, "is cut short or its header lies: it announces " + std::to_string(points) +
                             " points, but only " + std::to_string(bytes_left) +
                             " bytes of data follow");
}

CloudData CloudFiller::allocate(const CloudHeader& header, std::uint64_t bytes_left) const {
  checkSize(header, bytes_left);
  CloudData cloud;
  cloud.T_world_sensor = header.T_world_sensor;
  cloud.width = static_cast<std::uint32_t>(header.width);
  cloud.height = static_cast<std::uint32_t>(header.height);
  const std::size_t count = std::size_t{cloud.width} * cloud.height;
  cloud.xyz.resize(3 * count);
  for (const Column& column : columns_) {
    if (isDouble(column)) cloud.origin[static_cast<Eigen::Index>(column.target)] = NAN;
  }
  if (countOf(Target::PackedColor) + countOf(Target::Red) > 0) cloud.colors.resize(count);
  if (countOf(Target::Label) > 0) cloud.labels.resize(count);
  if (countOf(Target::Intensity) > 0) cloud.intensities.resize(count);
  return cloud;
}

bool CloudFiller::isDouble(const Column& column) const {
  return column.target <= Target::Z && column.field.type == ScalarType{'F', 8};
}

void CloudFiller::store(CloudData& cloud, const Column& column, std::size_t point,
                        double value) const {
  switch (column.target) {
    case Target::X:
    case Target::Y:
    case Target::Z: {
      double& origin = cloud.origin[static_cast<Eigen::Index>(column.target)];
      if (isDouble(column)) chooseOrigin(value, origin);
      cloud.xyz[3 * point + static_cast<std::size_t>(column.target)] = toFloat(value - origin);
      break;
    }
    case Target::PackedColor:
      cloud.colors[point] = colorOfNumber(value, column.field.type.isFloat());
      break;
    case Target::Red:
    case Target::Green:
    case Target::Blue: {
      const unsigned place =
          static_cast<unsigned>(column.target) - static_cast<unsigned>(Target::Red);
      cloud.colors[point] |= (toLabel(value) & 0xFFu) << (16u - 8u * place);
      break;
    }
    case Target::Label:
      cloud.labels[point] = toLabel(value);
      break;
    case Target::Intensity:
      cloud.intensities[point] = toFloat(value);
      break;
  }
}

void CloudFiller::fillColumn(CloudData& cloud, const Column& column, const std::uint8_t* data,
                             std::size_t stride, std::size_t first, std::size_t count,
                             bool big_endian) const {
  const ScalarType type = column.field.type;
  if (column.target <= Target::Z && type == ScalarType{'F', 4} && !big_endian) {
    float* out = cloud.xyz.data() + 3 * first + static_cast<std::size_t>(column.target);
    for (std::size_t i = 0; i < count; ++i) std::memcpy(out + 3 * i, data + i * stride, 4);
  } else if (column.target == Target::PackedColor) {
    std::uint32_t* out = cloud.colors.data() + first;
    for (std::size_t i = 0; i < count; ++i)
      out[i] = static_cast<std::uint32_t>(loadBits(data + i * stride, 4, big_endian)) & 0xFFFFFFu;
  } else {
    for (std::size_t i = 0; i < count; ++i)
      store(cloud, column, first + i, loadNumber(data + i * stride, type, big_endian));
  }
}

void CloudFiller::fillTransposed(CloudData& cloud, const std::uint8_t* data) const {
  const std::size_t count = cloud.size();
  for (const Column& column : columns_)
    fillColumn(cloud, column, data + column.field.offset * count, column.field.type.size, 0, count,
               false);
}

void CloudFiller::fillFromFile(CloudData& cloud, InputFile& file, bool big_endian) const {
  const std::size_t count = cloud.size();
  const bool bare = columns_.size() == 3 && record_size_ == 12 && !big_endian &&
                    columns_[0].target == Target::X && columns_[1].target == Target::Y;
  if (bare) return file.readExactly(cloud.xyz.data(), 12 * count);
  const std::size_t records_a_block = std::max<std::size_t>(1, kBlock / record_size_);
  std::vector<std::uint8_t> block(std::min(records_a_block, count) * record_size_);
  for (std::size_t first = 0; first < count; first += records_a_block) {
    const std::size_t records = std::min(records_a_block, count - first);
    file.readExactly(block.data(), records * record_size_);
    for (const Column& column : columns_)
      fillColumn(cloud, column, block.data() + column.field.offset, record_size_, first, records,
                 big_endian);
  }
}

void CloudFiller::parseWord(CloudData& cloud, const Column& column, std::size_t point,
                            std::string_view word, std::size_t line) const {
  double value = 0.0;
  const bool is_float = column.target <= Target::Z && !isDouble(column);
  const bool sound =
      is_float ? parseNumber(word, cloud.xyz[3 * point + static_cast<std::size_t>(column.target)])
               : parseNumber(word, value);
  if (!sound) failAtLine(path_, line, quoted(word) + " is no number");
  if (!is_float) store(cloud, column, point, value);
}

void CloudFiller::fillLines(CloudData& cloud, LineReader& lines) const {
  const std::size_t count = cloud.size();
  std::string_view line;
  std::size_t point = 0;
  while (point < count && lines.next(line)) {
    std::string_view rest = line;
    std::string_view word = takeWord(rest);
    if (word.empty()) continue;
    std::size_t words = 0;
    for (const Column& column : columns_) {
      for (; words < column.field.word && !word.empty(); ++words) word = takeWord(rest);
      if (word.empty()) break;
      parseWord(cloud, column, point, word, lines.number());
    }
    for (; !word.empty(); ++words) word = takeWord(rest);
    if (words != words_)
      failAtLine(path_, lines.number(),
                 std::to_string(words) + " values instead of " + std::to_string(words_));
    ++point;
  }
  if (point < count)
    throw IoError(path_, "is cut short: it announces " + std::to_string(count) +
                             " points, but holds " + std::to_string(point));
}

}  // namespace planar_mapping::io
