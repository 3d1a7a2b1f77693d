// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cfloat>
#include <cmath>
#include <limits>

#include "message.h"

namespace planar_mapping::transport {
namespace {

constexpr std::size_t kRawPointBytes = 3 * sizeof(float);
constexpr std::size_t kMaxVarintBytes = 5;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

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
std::uint32_t zigzag(std::uint32_t difference) {
  return (difference << 1U) ^ (0U - (difference >> 31U));
}
std::uint32_t fromZigzag(std::uint32_t value) {
  return (value >> 1U) ^ (0U - (value & 1U));
}

/// Coordinate of the ray of a pixel at depth z: one product, rounded once, the same on every
/// machine. 0 beyond the range of a float.
float onRay(double slope, float z) {
  const double value = slope * static_cast<double>(z);
  return std::abs(value) <= static_cast<double>(FLT_MAX) ? static_cast<float>(value) : 0.0F;
}

/// Slopes of the rays of all columns or rows; empty if one is not finite.
std::vector<double> slopes(std::uint32_t count, double centre, double focal_length) {
  std::vector<double> result(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    result[i] = (static_cast<double>(i) - centre) / focal_length;
    if (!std::isfinite(result[i])) return {};
  }
  return result;
}

/// Seven bits a byte, lowest first, the top bit set on all bytes but the last.
std::uint8_t* putVarint(std::uint8_t* out, std::uint64_t value) {
  for (; value >= 0x80U; value >>= 7U) *out++ = static_cast<std::uint8_t>(value | 0x80U);
  *out++ = static_cast<std::uint8_t>(value);
  return out;
}

std::uint64_t takeVarint(ByteReader& reader, std::uint64_t max_value) {
  std::uint64_t value = 0;
  for (unsigned shift = 0; shift < 7 * kMaxVarintBytes; shift += 7) {
    const std::uint64_t byte = *reader.take(1, "points");
    value |= (byte & 0x7FU) << shift;
    if (byte < 0x80U && value <= max_value) return value;
  }
  ByteReader::fail("points", "holds a number of more than 32 bits");
}

/// A hole is a 0; a point is three differences, the first plus 1.
Bytes compactPoints(const FrameCloud& cloud, const PinholeCamera& camera) {
  const std::vector<double> rows = slopes(cloud.height, camera.cy, camera.fy);
  const std::vector<double> columns = slopes(cloud.width, camera.cx, camera.fx);
  if (rows.size() * columns.size() != cloud.size()) return {};
  Bytes bytes(cloud.size() * 3 * kMaxVarintBytes);
  std::uint8_t* out = bytes.data();
  std::uint32_t before = orderedBits(0.0F);
  const pcl::PointXYZ* p = cloud.points.data();
  for (const double row : rows) {
    for (const double column : columns) {
      const pcl::PointXYZ& point = *p++;
      if (!isFinite(point)) {
        *out++ = 0;
        continue;
      }
      const std::uint32_t depth = orderedBits(point.z);
      out = putVarint(out, std::uint64_t{zigzag(depth - before)} + 1);
      out = putVarint(out, zigzag(orderedBits(point.x) - orderedBits(onRay(column, point.z))));
      out = putVarint(out, zigzag(orderedBits(point.y) - orderedBits(onRay(row, point.z))));
      before = depth;
    }
  }
  bytes.resize(static_cast<std::size_t>(out - bytes.data()));
  return bytes;
}

void readCompactPoints(ByteReader& reader, const PinholeCamera& camera, FrameCloud& cloud) {
  const std::vector<double> rows = slopes(cloud.height, camera.cy, camera.fy);
  const std::vector<double> columns = slopes(cloud.width, camera.cx, camera.fx);
  if (rows.size() * columns.size() != cloud.size()) {
    ByteReader::fail("camera", "does not suit the cloud");
  }
  constexpr std::uint64_t kMax = std::numeric_limits<std::uint32_t>::max();
  const auto difference = [&reader]() {
    return fromZigzag(static_cast<std::uint32_t>(takeVarint(reader, kMax)));
  };
  std::uint32_t depth = orderedBits(0.0F);
  pcl::PointXYZ* p = cloud.points.data();
  for (const double row : rows) {
    for (const double column : columns) {
      pcl::PointXYZ& point = *p++;
      const std::uint64_t first = takeVarint(reader, kMax + 1);
      if (first == 0) {
        point = {kNaN, kNaN, kNaN};
        continue;
      }
      depth += fromZigzag(static_cast<std::uint32_t>(first - 1));
      const float z = fromOrderedBits(depth);
      const float x = fromOrderedBits(orderedBits(onRay(column, z)) + difference());
      const float y = fromOrderedBits(orderedBits(onRay(row, z)) + difference());
      point = {x, y, z};
      if (!isFinite(point)) ByteReader::fail("points", "holds a value that is not finite");
    }
  }
}

void readRawPoints(ByteReader& reader, FrameCloud& cloud) {
  const std::uint8_t* in = reader.take(cloud.size() * kRawPointBytes, "points");
  for (pcl::PointXYZ& point : cloud.points) {
    std::memcpy(point.data, in, kRawPointBytes);
    in += kRawPointBytes;
    if (!isFinite(point)) point = {kNaN, kNaN, kNaN};
  }
}

}  // namespace

void writeCloud(ByteWriter& writer, const FrameCloud& cloud,
                const std::optional<PinholeCamera>& camera, CloudEncoding encoding) {
  if (std::size_t{cloud.width} * cloud.height != cloud.size()) {
    throw InputError("a cloud of " + std::to_string(cloud.width) + " x " +
                     std::to_string(cloud.height) + " has " + std::to_string(cloud.size()) +
                     " points");
  }
  Bytes points;
  if (camera && encoding == CloudEncoding::Compact) points = compactPoints(cloud, *camera);
  const bool is_compact = !points.empty() && points.size() < cloud.size() * kRawPointBytes;
  writer.number(cloud.width, "width");
  writer.number(cloud.height, "height");
  writer.number(cloud.is_dense, "is_dense");
  writer.enumeration(is_compact ? CloudEncoding::Compact : CloudEncoding::Raw,
                     CloudEncoding::Compact, "encoding");
  if (is_compact) return writer.put(points.data(), points.size());
  writer.bytes.reserve(writer.bytes.size() + cloud.size() * kRawPointBytes);
  for (const pcl::PointXYZ& point : cloud.points) writer.put(point.data, kRawPointBytes);
}

FrameCloud::Ptr readCloud(ByteReader& reader, const std::optional<PinholeCamera>& camera,
                          std::size_t max_points) {
  auto cloud = pcl::make_shared<FrameCloud>();
  CloudEncoding encoding = CloudEncoding::Raw;
  reader.number(cloud->width, "width");
  reader.number(cloud->height, "height");
  reader.number(cloud->is_dense, "is_dense");
  reader.enumeration(encoding, CloudEncoding::Compact, "encoding");
  const bool is_compact = encoding == CloudEncoding::Compact;
  const std::uint64_t size = std::uint64_t{cloud->width} * cloud->height;
  // No side of an empty cloud is longer either: memory is taken for it.
  if (size > max_points || size > reader.left() / (is_compact ? 1 : kRawPointBytes) ||
      std::max(cloud->width, cloud->height) > max_points) {
    ByteReader::fail("points", "has too many items");
  }
  if (is_compact && !camera) ByteReader::fail("camera", "is missing for a compact cloud");
  cloud->points.resize(static_cast<std::size_t>(size));
  is_compact ? readCompactPoints(reader, *camera, *cloud) : readRawPoints(reader, *cloud);
  return cloud;
}

}  // namespace planar_mapping::transport
