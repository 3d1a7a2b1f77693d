// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <zstd.h>

#include <cmath>
#include <limits>

#include "planar_mapping/transport/message.h"

namespace planar_mapping::transport {
namespace {

constexpr std::size_t kPointBytes = 3 * sizeof(float);
constexpr int kCompressionLevel = 1;  // the fastest: a frame takes milliseconds

bool isFinite(const pcl::PointXYZ& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
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

void check(const Frame& frame) {
  const auto require = [](bool holds, const char* what) {
    if (!holds) ByteReader::fail(what, "is out of range");
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

// The bytes of a cloud's floats by significance, all first ones before all second ones: those of
// neighbours are alike, and zstd finds them.
void writeCloud(ByteWriter& writer, const FrameCloud& cloud) {
  if (std::size_t{cloud.width} * cloud.height != cloud.size())
    throw InputError("a cloud of " + std::to_string(cloud.width) + " x " +
                     std::to_string(cloud.height) + " has " + std::to_string(cloud.size()) +
                     " points");
  writer.number(cloud.width, "width");
  writer.number(cloud.height, "height");
  writer.number(cloud.is_dense, "is_dense");
  const std::size_t begin = writer.bytes.size();
  writer.bytes.resize(begin + cloud.size() * kPointBytes);
  std::uint8_t* out = writer.bytes.data() + begin;
  for (std::size_t k = 0; k < kPointBytes; ++k) {
    for (const pcl::PointXYZ& point : cloud.points)
      *out++ = reinterpret_cast<const std::uint8_t*>(point.data)[k];
  }
}

FrameCloud::Ptr readCloud(ByteReader& reader) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  auto cloud = pcl::make_shared<FrameCloud>();
  reader.number(cloud->width, "width");
  reader.number(cloud->height, "height");
  reader.number(cloud->is_dense, "is_dense");
  const std::uint64_t size = std::uint64_t{cloud->width} * cloud->height;
  const std::size_t most = reader.left() / kPointBytes;
  // No side of an empty cloud is longer either: memory is taken for it.
  if (size > most || std::max(cloud->width, cloud->height) > most)
    ByteReader::fail("points", "has too many items");
  cloud->points.resize(static_cast<std::size_t>(size));
  const std::uint8_t* in = reader.take(cloud->size() * kPointBytes, "points");
  for (std::size_t k = 0; k < kPointBytes; ++k) {
    for (pcl::PointXYZ& point : cloud->points)
      reinterpret_cast<std::uint8_t*>(point.data)[k] = *in++;
  }
  for (pcl::PointXYZ& point : cloud->points) {
    if (!isFinite(point)) point = {kNaN, kNaN, kNaN};
  }
  return cloud;
}

Bytes packed(const Bytes& bytes) {
  Bytes out(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kCompressionLevel);
  if (ZSTD_isError(size) != 0) throw Error("a frame cannot be compressed");
  out.resize(size);
  return out;
}

/// Takes no more memory than the limit, whatever the data announces.
Bytes unpacked(ByteReader& reader, std::size_t max_bytes) {
  const std::size_t size = reader.left();
  const std::uint8_t* data = reader.take(size, "frame");
  const unsigned long long announced = ZSTD_getFrameContentSize(data, size);
  if (announced > max_bytes) ByteReader::fail("frame", "is damaged or too large");
  Bytes bytes(static_cast<std::size_t>(announced));
  if (ZSTD_decompress(bytes.data(), bytes.size(), data, size) != bytes.size())
    ByteReader::fail("frame", "is damaged");
  return bytes;
}

Frame readFrame(ByteReader reader) {
  Frame frame;
  frame.front_end_done = true;
  transferFields(reader, frame);
  transferNotes(reader, frame.notes, "notes");
  transferNotes(reader, frame.warnings, "warnings");
  check(frame);
  frame.cloud = readCloud(reader);
  const std::size_t tiles =
      std::size_t{frame.cloud->width / kEvenTileSide} * (frame.cloud->height / kEvenTileSide);
  if (!frame.even.empty() && frame.even.size() != tiles)
    throw ProtocolError("field 'even' has another size than the cloud");
  readImage(reader, frame);
  reader.expectEnd();
  return frame;
}

}  // namespace

Bytes encodeFrame(const InputDescription& input, std::uint64_t position, const Frame& frame,
                  CloudEncoding encoding, std::size_t max_bytes) {
  if (frame.cloud == nullptr) throw InputError("a frame without a cloud cannot be sent");
  ByteWriter fields;
  transferFields(fields, frame);
  transferNotes(fields, firstOf(frame.notes), "notes");
  transferNotes(fields, firstOf(frame.warnings), "warnings");
  writeCloud(fields, *frame.cloud);
  writeImage(fields, frame);
  if (fields.bytes.size() > max_bytes)
    throw InputError("frame " + std::to_string(position) + " takes " +
                     std::to_string(fields.bytes.size()) + " bytes, and the mapping side takes " +
                     std::to_string(max_bytes) +
                     " at most; start it with a larger --max-message-mb");
  const bool is_raw = encoding == CloudEncoding::Raw;
  const Bytes body = is_raw ? std::move(fields.bytes) : packed(fields.bytes);
  ByteWriter writer;
  writer.bytes = encode(input, Count{position});
  writer.enumeration(encoding, CloudEncoding::Compact, "encoding");
  writer.put(body.data(), body.size());
  return std::move(writer.bytes);
}

Frame decodeFrame(ByteReader& reader, std::size_t max_bytes) {
  CloudEncoding encoding = CloudEncoding::Raw;
  reader.enumeration(encoding, CloudEncoding::Compact, "encoding");
  if (encoding == CloudEncoding::Raw) return readFrame(reader);
  const Bytes bytes = unpacked(reader, max_bytes);
  return readFrame({bytes.data(), bytes.size()});
}

}  // namespace planar_mapping::transport
