// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cloud_coding.h"

#include <cfloat>
#include <cmath>
#include <limits>

namespace planar_mapping::transport::detail {
namespace {

constexpr std::size_t kRawPointBytes = 3 * sizeof(float);
constexpr std::size_t kSmallestCompactPoint = 3;  // bytes
constexpr std::size_t kLargestVarint = 5;         // bytes of 32 bits, seven at a time

bool isFinite(const pcl::PointXYZ& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

/// Floats as integers of the same order: neighbours differ by one, and no bit is lost.
std::uint32_t orderedBits(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return (bits & 0x80000000U) != 0 ? ~bits : bits | 0x80000000U;
}

float fromOrderedBits(std::uint32_t ordered) {
  const std::uint32_t bits = (ordered & 0x80000000U) != 0 ? ordered & 0x7FFFFFFFU : ~ordered;
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

/// Small differences of either sign become small numbers (zigzag).
std::uint32_t folded(std::uint32_t difference) {
  return (difference << 1U) ^ (0U - (difference >> 31U));
}
std::uint32_t unfolded(std::uint32_t value) {
  return (value >> 1U) ^ (0U - (value & 1U));
}

/// Where the ray of a pixel is at depth z. One product, rounded once: the same on every machine.
/// Doubles that no float can hold (IEEE would make them infinite) become 0.
float onRay(double slope, float z) {
  const double value = slope * static_cast<double>(z);
  return std::abs(value) <= static_cast<double>(FLT_MAX) ? static_cast<float>(value) : 0.0F;
}

/// Slopes of the rays of all columns and rows.
struct Rays {
  std::vector<double> column;
  std::vector<double> row;
  bool usable = true;
};

std::vector<double> slopes(std::uint32_t count, double centre, double focal_length, bool& usable) {
  std::vector<double> result(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    result[i] = (static_cast<double>(i) - centre) / focal_length;
    usable = usable && std::isfinite(result[i]);
  }
  return result;
}

Rays raysOf(const std::optional<PinholeCamera>& camera, std::uint32_t width, std::uint32_t height) {
  Rays rays;
  rays.usable = camera.has_value();
  if (!rays.usable) return rays;
  rays.column = slopes(width, camera->cx, camera->fx, rays.usable);
  rays.row = slopes(height, camera->cy, camera->fy, rays.usable);
  return rays;
}

std::uint8_t* putVarint(std::uint8_t* out, std::uint32_t value) {
  while (value >= 0x80U) {
    *out++ = static_cast<std::uint8_t>(value | 0x80U);
    value >>= 7U;
  }
  *out++ = static_cast<std::uint8_t>(value);
  return out;
}

/// \throws ProtocolError if it is cut, or longer than 32 bits
std::uint32_t getVarint(const std::uint8_t*& in, const std::uint8_t* end) {
  std::uint32_t value = 0;
  for (unsigned shift = 0; shift < 7 * kLargestVarint; shift += 7) {
    if (in == end) throw ProtocolError("it ends within field 'points'");
    const std::uint32_t byte = *in++;
    value |= (byte & 0x7FU) << shift;
    if (byte < 0x80U) {
      if (shift == 28 && byte > 0x0FU) break;
      return value;
    }
  }
  throw ProtocolError("field 'points' holds a number of more than 32 bits");
}

std::uint8_t* putRaw(std::uint8_t* out, const pcl::PointXYZ& p) {
  for (const float value : {p.x, p.y, p.z}) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    for (unsigned i = 0; i < 4; ++i) *out++ = static_cast<std::uint8_t>(bits >> (8U * i));
  }
  return out;
}

/// Both return how many bytes were written.
std::size_t writeRaw(const FrameCloud& cloud, std::uint8_t* out) {
  const std::uint8_t* const first = out;
  for (const pcl::PointXYZ& p : cloud.points) {
    if (isFinite(p)) out = putRaw(out, p);
  }
  return static_cast<std::size_t>(out - first);
}

std::size_t writeCompact(const FrameCloud& cloud, const Rays& rays, std::uint8_t* out) {
  const std::uint8_t* const first = out;
  std::uint32_t depth_before = orderedBits(0.0F);
  std::size_t i = 0;
  for (const double row_slope : rays.row) {
    for (const double column_slope : rays.column) {
      const pcl::PointXYZ& p = cloud.points[i++];
      if (!isFinite(p)) continue;
      const std::uint32_t depth = orderedBits(p.z);
      out = putVarint(out, folded(depth - depth_before));
      out = putVarint(out, folded(orderedBits(p.x) - orderedBits(onRay(column_slope, p.z))));
      out = putVarint(out, folded(orderedBits(p.y) - orderedBits(onRay(row_slope, p.z))));
      depth_before = depth;
    }
  }
  return static_cast<std::size_t>(out - first);
}

/// A bit per point, lowest first, set where it is finite.
Bytes presenceOf(const FrameCloud& cloud, std::size_t& present) {
  Bytes bits((cloud.size() + 7) / 8, 0);
  present = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!isFinite(cloud.points[i])) continue;
    bits[i / 8] = static_cast<std::uint8_t>(bits[i / 8] | (1U << (i % 8)));
    ++present;
  }
  return bits;
}

/// \throws ProtocolError unless exactly `present` of the first `size` bits are set and no other
void checkPresence(const std::uint8_t* bits, std::size_t size, std::size_t present) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < (size + 7) / 8; ++i) {
    count += static_cast<std::size_t>(__builtin_popcount(bits[i]));
  }
  const bool beyond = size % 8 != 0 && (bits[size / 8] >> (size % 8)) != 0;
  if (count != present || beyond) {
    throw ProtocolError("field 'presence' does not have as many bits set as points are finite");
  }
}

float rawFloat(const std::uint8_t* in) {
  std::uint32_t bits = 0;
  for (unsigned i = 0; i < 4; ++i) bits |= static_cast<std::uint32_t>(in[i]) << (8U * i);
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

void readRaw(ByteReader& reader, const std::uint8_t* bits, std::size_t present, FrameCloud& cloud) {
  const std::uint8_t* in = reader.take(present * kRawPointBytes, "points");
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (bits != nullptr && (bits[i / 8] >> (i % 8) & 1U) == 0) continue;
    cloud.points[i] = pcl::PointXYZ(rawFloat(in), rawFloat(in + 4), rawFloat(in + 8));
    in += kRawPointBytes;
  }
}

void readCompact(ByteReader& reader, const std::uint8_t* bits, const Rays& rays,
                 FrameCloud& cloud) {
  const std::size_t size = reader.left();
  const std::uint8_t* const first = reader.take(0, "points");
  const std::uint8_t* in = first;
  std::uint32_t depth = orderedBits(0.0F);
  std::size_t i = 0;
  for (const double row_slope : rays.row) {
    for (const double column_slope : rays.column) {
      const std::size_t index = i++;
      if (bits != nullptr && (bits[index / 8] >> (index % 8) & 1U) == 0) continue;
      depth += unfolded(getVarint(in, first + size));
      const float z = fromOrderedBits(depth);
      const std::uint32_t dx = unfolded(getVarint(in, first + size));
      const std::uint32_t dy = unfolded(getVarint(in, first + size));
      cloud.points[index] =
          pcl::PointXYZ(fromOrderedBits(orderedBits(onRay(column_slope, z)) + dx),
                        fromOrderedBits(orderedBits(onRay(row_slope, z)) + dy), z);
    }
  }
  reader.take(static_cast<std::size_t>(in - first), "points");
}

}  // namespace

void writeCloud(const FrameCloud& cloud, const std::optional<PinholeCamera>& camera,
                CloudEncoding encoding, Bytes& bytes) {
  if (std::size_t{cloud.width} * cloud.height != cloud.size()) {
    throw InputError("a cloud of " + std::to_string(cloud.width) + " x " +
                     std::to_string(cloud.height) + " has " + std::to_string(cloud.size()) +
                     " points");
  }
  std::size_t present = 0;
  const Bytes presence = presenceOf(cloud, present);
  const Rays rays = encoding == CloudEncoding::Compact ? raysOf(camera, cloud.width, cloud.height)
                                                       : Rays{{}, {}, false};
  Bytes points(present * (rays.usable ? 3 * kLargestVarint : kRawPointBytes));
  CloudEncoding used = rays.usable ? CloudEncoding::Compact : CloudEncoding::Raw;
  std::size_t size = rays.usable ? writeCompact(cloud, rays, points.data()) : points.size();
  if (used == CloudEncoding::Raw || size > present * kRawPointBytes) {
    used = CloudEncoding::Raw;
    size = writeRaw(cloud, points.data());
  }
  ByteWriter writer(bytes);
  writer.integer(cloud.width);
  writer.integer(cloud.height);
  writer.boolean(cloud.is_dense);
  writer.integer(static_cast<std::uint8_t>(used));
  writer.integer(static_cast<std::uint32_t>(present));
  if (present < cloud.size()) bytes.insert(bytes.end(), presence.begin(), presence.end());
  bytes.insert(bytes.end(), points.begin(), points.begin() + static_cast<std::ptrdiff_t>(size));
}

FrameCloud::Ptr readCloud(ByteReader& reader, const std::optional<PinholeCamera>& camera,
                          std::size_t largest_points) {
  const auto width = reader.integer<std::uint32_t>("width");
  const auto height = reader.integer<std::uint32_t>("height");
  const bool is_dense = reader.boolean("is_dense");
  const auto encoding = reader.integer<std::uint8_t>("encoding");
  if (encoding > static_cast<std::uint8_t>(CloudEncoding::Compact)) {
    throw ProtocolError("field 'encoding' has the unknown value " + std::to_string(encoding));
  }
  const bool compact = encoding == static_cast<std::uint8_t>(CloudEncoding::Compact);
  const std::uint64_t size = std::uint64_t{width} * height;
  if (size > largest_points) {
    throw ProtocolError("a cloud of " + std::to_string(width) + " x " + std::to_string(height) +
                        " points is larger than the " + std::to_string(largest_points) +
                        " that are taken");
  }
  const std::size_t present =
      reader.count("present", compact ? kSmallestCompactPoint : kRawPointBytes, size);
  const std::uint8_t* bits = nullptr;
  if (present < size) {
    bits = reader.take((size + 7) / 8, "presence");
    checkPresence(bits, size, present);
  }
  const Rays rays = compact ? raysOf(camera, width, height) : Rays();
  if (!rays.usable) throw ProtocolError("a compact cloud comes without the camera it needs");

  auto cloud = pcl::make_shared<FrameCloud>();
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  cloud->points.assign(size, pcl::PointXYZ(kNaN, kNaN, kNaN));
  cloud->width = width;
  cloud->height = height;
  cloud->is_dense = is_dense;
  if (compact) {
    readCompact(reader, bits, rays, *cloud);
  } else {
    readRaw(reader, bits, present, *cloud);
  }
  std::size_t finite = 0;
  for (const pcl::PointXYZ& p : cloud->points) finite += isFinite(p) ? 1 : 0;
  if (finite != present) throw ProtocolError("field 'points' holds a value that is not finite");
  return cloud;
}

}  // namespace planar_mapping::transport::detail
