// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "cloud_coding.h"
#include "planar_mapping/transport/message.h"
#include "printable.h"

namespace planar_mapping::transport {
namespace {

using detail::ByteReader;
using detail::ByteWriter;

constexpr std::size_t kLargestFeatureCount = 1000000;
constexpr std::size_t kLargestStatisticCount = 256;
constexpr std::size_t kLargestStageCount = 256;
constexpr std::size_t kLargestNoteCount = 1000;
constexpr std::size_t kFeatureBytes = 48;
constexpr std::size_t kLargestName = 64;  // of a statistic
constexpr double kFarthest = 1e12;        // metres; its square stays finite in a float
constexpr double kRotationTolerance = 1e-6;
constexpr double kLargestPixel = 1e9;

bool isPlausible(double value) {
  return std::abs(value) <= kFarthest;  // not for NaN
}

bool isRigid(const Pose& pose) {
  const Matrix3 rotation = pose.linear();
  return (rotation.transpose() * rotation - Matrix3::Identity()).cwiseAbs().maxCoeff() <=
             kRotationTolerance &&
         rotation.determinant() > 0.0 && isPlausible(pose.translation().cwiseAbs().maxCoeff()) &&
         pose.matrix().allFinite();
}

bool isUsable(const PinholeCamera& camera) {
  const auto isLength = [](double value) { return value > 0.0 && value <= kLargestPixel; };
  return isLength(camera.fx) && isLength(camera.fy) && std::abs(camera.cx) <= kLargestPixel &&
         std::abs(camera.cy) <= kLargestPixel && camera.width >= 0 && camera.height >= 0;
}

/// Pixels may be unknown, places may not.
bool isUsable(const KeyFeature& feature) {
  const auto isPixel = [](float value) {
    return std::isnan(value) || std::abs(value) <= static_cast<float>(kLargestPixel);
  };
  return feature.track >= 0 && feature.sightings >= 1 && isPixel(feature.column) &&
         isPixel(feature.row) && isPixel(feature.disparity) &&
         isPlausible(feature.position.cwiseAbs().maxCoeff()) && feature.position.allFinite();
}

bool isColumnName(const std::string& name) {
  const auto isAllowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !name.empty() && name.size() <= kLargestName &&
         std::all_of(name.begin(), name.end(), isAllowed);
}

/// The same rules for what is sent and what is received; Problem is InputError or ProtocolError.
template <typename Problem>
void checkFrame(const Frame& frame) {
  const auto require = [](bool holds, const std::string& what) {
    if (!holds) throw Problem(what);
  };
  require(std::isfinite(frame.timestamp), "field 'timestamp' is not finite");
  require(isRigid(frame.T_world_sensor), "field 'T_world_sensor' is no rigid motion");
  require(!frame.given_pose || isRigid(*frame.given_pose), "field 'given_pose' is no rigid motion");
  require(!frame.camera || isUsable(*frame.camera), "field 'camera' is out of range");
  require(!frame.baseline || (*frame.baseline > 0.0 && isPlausible(*frame.baseline)),
          "field 'baseline' is out of range");
  for (const KeyFeature& feature : frame.key_features) {
    require(isUsable(feature), "a key feature of track " + std::to_string(feature.track) +
                                   " is not finite or out of range");
  }
  for (const FrameStatistic& statistic : frame.statistics) {
    require(isColumnName(statistic.name), "the name of a statistic is not snake_case");
  }
  for (const double value : frame.stage_ms) {
    require(value >= 0.0 && std::isfinite(value), "field 'stage_ms' is out of range");
  }
  require(frame.stage_ms.size() <= kLargestStageCount, "there are too many stages");
  require(frame.key_features.size() <= kLargestFeatureCount, "there are too many key features");
  require(frame.statistics.size() <= kLargestStatisticCount, "there are too many statistics");
  require(frame.notes.size() <= kLargestNoteCount && frame.warnings.size() <= kLargestNoteCount,
          "there are too many notes or warnings");
}

void writePose(ByteWriter& writer, const Pose& pose) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) writer.real(pose.matrix()(row, column));
  }
}

Pose readPose(ByteReader& reader, const char* field) {
  Pose pose = Pose::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) pose.matrix()(row, column) = reader.real64(field);
  }
  return pose;
}

void writeCamera(ByteWriter& writer, const PinholeCamera& camera) {
  for (const double value : {camera.fx, camera.fy, camera.cx, camera.cy}) writer.real(value);
  writer.integer(static_cast<std::uint32_t>(camera.width));
  writer.integer(static_cast<std::uint32_t>(camera.height));
}

PinholeCamera readCamera(ByteReader& reader) {
  PinholeCamera camera;
  for (double* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) {
    *value = reader.real64("camera");
  }
  camera.width = static_cast<std::int32_t>(reader.integer<std::uint32_t>("camera"));
  camera.height = static_cast<std::int32_t>(reader.integer<std::uint32_t>("camera"));
  return camera;
}

void writeFeatures(ByteWriter& writer, const std::vector<KeyFeature>& features) {
  writer.integer(static_cast<std::uint32_t>(features.size()));
  for (const KeyFeature& feature : features) {
    writer.integer(static_cast<std::uint64_t>(feature.track));
    writer.integer(static_cast<std::uint32_t>(feature.sightings));
    for (const float value : {feature.column, feature.row, feature.disparity}) writer.real(value);
    for (int axis = 0; axis < 3; ++axis) writer.real(feature.position[axis]);
  }
}

std::vector<KeyFeature> readFeatures(ByteReader& reader) {
  std::vector<KeyFeature> features(
      reader.count("key_features", kFeatureBytes, kLargestFeatureCount));
  for (KeyFeature& feature : features) {
    feature.track = static_cast<std::int64_t>(reader.integer<std::uint64_t>("track"));
    feature.sightings = static_cast<std::int32_t>(reader.integer<std::uint32_t>("sightings"));
    for (float* value : {&feature.column, &feature.row, &feature.disparity}) {
      *value = reader.real32("pixel");
    }
    for (int axis = 0; axis < 3; ++axis) feature.position[axis] = reader.real64("position");
  }
  return features;
}

void writeTexts(ByteWriter& writer, const std::vector<std::string>& texts) {
  writer.integer(static_cast<std::uint32_t>(texts.size()));
  for (const std::string& text : texts) writer.text(text);
}

std::vector<std::string> readTexts(ByteReader& reader, const char* field) {
  std::vector<std::string> texts(reader.count(field, sizeof(std::uint32_t), kLargestNoteCount));
  for (std::string& text : texts) text = detail::printable(reader.text(field));
  return texts;
}

void writeStatistics(ByteWriter& writer, const std::vector<FrameStatistic>& statistics) {
  writer.integer(static_cast<std::uint32_t>(statistics.size()));
  for (const FrameStatistic& statistic : statistics) {
    writer.text(statistic.name);
    writer.real(statistic.value);
  }
}

std::vector<FrameStatistic> readStatistics(ByteReader& reader) {
  constexpr std::size_t kSmallest = sizeof(std::uint32_t) + sizeof(double);
  std::vector<FrameStatistic> statistics(
      reader.count("statistics", kSmallest, kLargestStatisticCount));
  for (FrameStatistic& statistic : statistics) {
    statistic.name = reader.text("statistic", kLargestName);
    statistic.value = reader.real64("statistic");
  }
  return statistics;
}

}  // namespace

Bytes encodeFrame(const Frame& frame, std::uint64_t position, CloudEncoding encoding) {
  if (frame.cloud == nullptr) throw InputError("a frame without a cloud cannot be sent");
  checkFrame<InputError>(frame);
  Bytes bytes;
  ByteWriter writer(bytes);
  writer.integer(position);
  writer.integer(static_cast<std::uint64_t>(frame.number));
  writer.real(frame.timestamp);
  writer.text(frame.source);
  writer.text(frame.skip_reason);
  writePose(writer, frame.T_world_sensor);
  writer.boolean(frame.given_pose.has_value());
  if (frame.given_pose) writePose(writer, *frame.given_pose);
  writer.boolean(frame.camera.has_value());
  if (frame.camera) writeCamera(writer, *frame.camera);
  writer.boolean(frame.baseline.has_value());
  if (frame.baseline) writer.real(*frame.baseline);
  for (const std::size_t value : {frame.points_input, frame.features, frame.matches}) {
    writer.integer(static_cast<std::uint64_t>(value));
  }
  writeFeatures(writer, frame.key_features);
  writeStatistics(writer, frame.statistics);
  writer.integer(static_cast<std::uint32_t>(frame.stage_ms.size()));
  for (const double value : frame.stage_ms) writer.real(value);
  writeTexts(writer, frame.notes);
  writeTexts(writer, frame.warnings);
  detail::writeCloud(*frame.cloud, frame.camera, encoding, bytes);
  return bytes;
}

FrameMessage decodeFrame(const Bytes& body, std::size_t largest_points) {
  ByteReader reader(body);
  FrameMessage message;
  Frame& frame = message.frame;
  frame.front_end_done = true;
  message.position = reader.integer<std::uint64_t>("position");
  frame.number = reader.integer<std::uint64_t>("number");
  frame.timestamp = reader.real64("timestamp");
  frame.source = detail::printable(reader.text("source"));
  frame.skip_reason = detail::printable(reader.text("skip_reason"));
  frame.T_world_sensor = readPose(reader, "T_world_sensor");
  if (reader.boolean("has_given_pose")) frame.given_pose = readPose(reader, "given_pose");
  if (reader.boolean("has_camera")) frame.camera = readCamera(reader);
  if (reader.boolean("has_baseline")) frame.baseline = reader.real64("baseline");
  for (std::size_t* value : {&frame.points_input, &frame.features, &frame.matches}) {
    *value = reader.integer<std::uint64_t>("counts");
  }
  frame.key_features = readFeatures(reader);
  frame.statistics = readStatistics(reader);
  frame.stage_ms.resize(reader.count("stage_ms", sizeof(double), kLargestStageCount));
  for (double& value : frame.stage_ms) value = reader.real64("stage_ms");
  frame.notes = readTexts(reader, "notes");
  frame.warnings = readTexts(reader, "warnings");
  checkFrame<ProtocolError>(frame);
  frame.cloud = detail::readCloud(reader, frame.camera, largest_points);
  reader.expectEnd();
  return message;
}

}  // namespace planar_mapping::transport
