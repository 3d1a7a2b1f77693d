// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "message.h"

namespace planar_mapping::transport {
namespace {

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
  transferPose(archive, frame.T_world_sensor, "T_world_sensor");
  if (archive.optional(frame.given_pose, "given_pose")) {
    transferPose(archive, *frame.given_pose, "given_pose");
  }
  if (archive.optional(frame.camera, "camera")) {
    auto& camera = *frame.camera;
    for (auto* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) {
      archive.number(*value, "camera");
    }
    for (auto* value : {&camera.width, &camera.height}) archive.number(*value, "camera");
  }
  if (archive.optional(frame.baseline, "baseline")) archive.number(*frame.baseline, "baseline");
  for (auto* value : {&frame.points_input, &frame.features, &frame.matches}) {
    archive.size(*value, "counts");
  }
  archive.resize(frame.key_features, "key_features", kFeatureBytes, kMaxFeatures);
  for (auto& feature : frame.key_features) {
    archive.number(feature.track, "track");
    archive.number(feature.sightings, "sightings");
    for (auto* value : {&feature.column, &feature.row, &feature.disparity}) {
      archive.number(*value, "pixel");
    }
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
  if (pixels.size() != frame.cloud->size() || !frame.camera) {
    throw ProtocolError("field 'image' has another size than the cloud");
  }
  const std::uint8_t* data = reader.take(pixels.size(), "image");
  pixels.assign(data, data + pixels.size());
  frame.images.left = {static_cast<int>(frame.cloud->width), static_cast<int>(frame.cloud->height),
                       1, std::move(pixels)};
}

std::vector<std::string> firstOf(const std::vector<std::string>& texts) {
  const auto count = static_cast<std::ptrdiff_t>(std::min(texts.size(), kMaxNotes));
  return {texts.begin(), texts.begin() + count};
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
