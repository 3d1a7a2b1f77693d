// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cfloat>
#include <cmath>
#include <limits>

#include "planar_mapping/transport/message.h"

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
  if (rows.size() * columns.size() != cloud.size())
    ByteReader::fail("camera", "does not suit the cloud");
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

constexpr std::size_t kMaxFeatures = 1000000;
constexpr std::size_t kFeatureBytes = 48;
constexpr std::size_t kMaxStatistics = 64;
constexpr std::size_t kMaxTiles = 1u << 24;
constexpr std::size_t kMaxStages = 256;
constexpr std::size_t kMaxNotes = 32;  // and warnings; further ones are not sent
constexpr std::size_t kMaxName = 64;   // of a statistic
constexpr double kMaxDistance = 1e12;  // metres; its square stays finite in a float
constexpr double kMaxPixel = 1e9;
constexpr double kRotationTolerance = 1e-6;

// All are false for NaN.
bool isDistance(double value) {
  return std::abs(value) <= kMaxDistance;
}
bool isPlace(const Vector3& place) {
  return isDistance(place.x()) && isDistance(place.y()) && isDistance(place.z());
}
bool isPixel(double value) {
  return std::abs(value) <= kMaxPixel;
}
bool isPixelOrUnknown(float value) {
  return std::isnan(value) || isPixel(static_cast<double>(value));
}

bool isRigid(const Pose& pose) {
  const Matrix3 rotation = pose.linear();
  const Matrix3 product = rotation.transpose() * rotation;
  return rotation.allFinite() && product.isIdentity(kRotationTolerance) &&
         rotation.determinant() > 0.0 && isPlace(pose.translation());
}

bool isUsable(const PinholeCamera& camera) {
  return camera.fx > 0.0 && camera.fy > 0.0 && isPixel(camera.fx) && isPixel(camera.fy) &&
         isPixel(camera.cx) && isPixel(camera.cy) && camera.width >= 0 && camera.height >= 0;
}

bool isUsable(const KeyFeature& feature) {
  return feature.track >= 0 && feature.sightings >= 1 && isPixelOrUnknown(feature.column) &&
         isPixelOrUnknown(feature.row) && isPixelOrUnknown(feature.disparity) &&
         isPlace(feature.position);
}

bool isColumnName(const std::string& name) {
  return !name.empty() && name.size() <= kMaxName &&
         name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_.") == std::string::npos;
}

/// The same rules for what is sent and what is received; Problem is InputError or ProtocolError.
template <typename Problem>
void check(const Frame& frame) {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw Problem(std::string("field '") + what + "' is out of range");
  };
  require(std::isfinite(frame.timestamp), "timestamp");
  require(isRigid(frame.T_world_sensor), "T_world_sensor");
  require(!frame.given_pose || isRigid(*frame.given_pose), "given_pose");
  require(!frame.camera || isUsable(*frame.camera), "camera");
  require(!frame.baseline || (*frame.baseline > 0.0 && isDistance(*frame.baseline)), "baseline");
  for (const KeyFeature& feature : frame.key_features) require(isUsable(feature), "key_features");
  for (const auto& item : frame.statistics) require(isColumnName(item.name), "statistics");
  for (const double ms : frame.stage_ms) require(ms >= 0.0 && std::isfinite(ms), "stage_ms");
}

template <typename Archive, typename PoseType>
void transferPose(Archive& archive, PoseType& pose, const char* field) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) archive.number(pose.matrix()(row, column), field);
  }
}

template <typename Archive, typename Texts>
void transferNotes(Archive& archive, Texts&& texts, const char* field) {
  archive.resize(texts, field, sizeof(std::uint32_t), kMaxNotes);
  for (auto& text : texts) archive.text(text, field);
}

/// \tparam FrameType  Frame to read, const Frame to write
template <typename Archive, typename FrameType>
void transferFields(Archive& archive, FrameType& frame) {
  archive.size(frame.number, "number");
  archive.number(frame.timestamp, "timestamp");
  archive.text(frame.source, "source");
  archive.text(frame.skip_reason, "skip_reason");
  archive.number(frame.pose_assumed, "pose_assumed");
  archive.number(frame.without_sensor, "without_sensor");
  archive.number(frame.images_changed, "images_changed");
  archive.number(frame.image_doubtful, "image_doubtful");
  transferPose(archive, frame.T_world_sensor, "T_world_sensor");
  if (archive.optional(frame.given_pose, "given_pose"))
    transferPose(archive, *frame.given_pose, "given_pose");
  if (archive.optional(frame.camera, "camera")) {
    auto& camera = *frame.camera;
    for (auto* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy})
      archive.number(*value, "camera");
    for (auto* value : {&camera.width, &camera.height}) archive.number(*value, "camera");
  }
  if (archive.optional(frame.baseline, "baseline")) archive.number(*frame.baseline, "baseline");
  for (auto* value : {&frame.points_input, &frame.features, &frame.matches})
    archive.size(*value, "counts");
  archive.resize(frame.key_features, "key_features", kFeatureBytes, kMaxFeatures);
  for (auto& feature : frame.key_features) {
    archive.number(feature.track, "track");
    archive.number(feature.sightings, "sightings");
    for (auto* value : {&feature.column, &feature.row, &feature.disparity})
      archive.number(*value, "pixel");
    for (int axis = 0; axis < 3; ++axis) archive.number(feature.position[axis], "position");
  }
  archive.resize(frame.even, "even", 1, kMaxTiles);
  for (auto& flags : frame.even) archive.number(flags, "even");
  archive.resize(frame.statistics, "statistics", sizeof(std::uint32_t) + sizeof(double),
                 kMaxStatistics);
  for (auto& statistic : frame.statistics) {
    archive.text(statistic.name, "statistics", kMaxName);
    archive.number(statistic.value, "statistics");
  }
  archive.resize(frame.stage_ms, "stage_ms", sizeof(double), kMaxStages);
  for (auto& ms : frame.stage_ms) archive.number(ms, "stage_ms");
}

/// What the mapping side compares views by: the gray left image, if it has the size of the cloud.
void writeImage(ByteWriter& writer, const Frame& frame) {
  const io::Image& left = frame.images.left;
  const bool is_seen = frame.camera && !left.empty() &&
                       left.width == static_cast<int>(frame.cloud->width) &&
                       left.height == static_cast<int>(frame.cloud->height);
  const io::Image gray = is_seen ? io::toGray(left) : io::Image();
  writer.resize(gray.pixels, "image", 1, gray.pixels.size());
  writer.put(gray.pixels.data(), gray.pixels.size());
}

void readImage(ByteReader& reader, Frame& frame) {
  std::vector<std::uint8_t> pixels;
  reader.resize(pixels, "image", 1, frame.cloud->size());
  if (pixels.empty()) return;
  if (pixels.size() != frame.cloud->size() || !frame.camera)
    throw ProtocolError("field 'image' has another size than the cloud");
  const std::uint8_t* data = reader.take(pixels.size(), "image");
  pixels.assign(data, data + pixels.size());
  frame.images.left = {static_cast<int>(frame.cloud->width), static_cast<int>(frame.cloud->height),
                       1, std::move(pixels)};
}

std::vector<std::string> firstOf(const std::vector<std::string>& texts) {
  const auto count = static_cast<std::ptrdiff_t>(std::min(texts.size(), kMaxNotes));
  return {texts.begin(), texts.begin() + count};
}

void writeCloud(ByteWriter& writer, const FrameCloud& cloud,
                const std::optional<PinholeCamera>& camera, CloudEncoding encoding) {
  if (std::size_t{cloud.width} * cloud.height != cloud.size())
    throw InputError("a cloud of " + std::to_string(cloud.width) + " x " +
                     std::to_string(cloud.height) + " has " + std::to_string(cloud.size()) +
                     " points");
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

}  // namespace

Bytes encodeFrame(const InputDescription& input, std::uint64_t position, const Frame& frame,
                  CloudEncoding encoding) {
  if (frame.cloud == nullptr) throw InputError("a frame without a cloud cannot be sent");
  check<InputError>(frame);
  ByteWriter writer;
  writer.bytes = encode(input, Count{position});
  transferFields(writer, frame);
  transferNotes(writer, firstOf(frame.notes), "notes");
  transferNotes(writer, firstOf(frame.warnings), "warnings");
  writeCloud(writer, *frame.cloud, frame.camera, encoding);
  writeImage(writer, frame);
  return std::move(writer.bytes);
}

Frame decodeFrame(ByteReader& reader, std::size_t max_points) {
  Frame frame;
  frame.front_end_done = true;
  transferFields(reader, frame);
  transferNotes(reader, frame.notes, "notes");
  transferNotes(reader, frame.warnings, "warnings");
  check<ProtocolError>(frame);
  frame.cloud = readCloud(reader, frame.camera, max_points);
  const std::size_t tiles =
      std::size_t{frame.cloud->width / kEvenTileSide} * (frame.cloud->height / kEvenTileSide);
  if (!frame.even.empty() && frame.even.size() != tiles)
    throw ProtocolError("field 'even' has another size than the cloud");
  readImage(reader, frame);
  reader.expectEnd();
  return frame;
}

}  // namespace planar_mapping::transport
