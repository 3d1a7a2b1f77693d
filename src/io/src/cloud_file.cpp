// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/cloud_file.h"

#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "cloud_layout.h"
#include "input_file.h"
#include "planar_mapping/core/base/error.h"
#include "text_lines.h"

namespace planar_mapping::io {
namespace {

constexpr std::size_t kLongestLine = 4096;
constexpr std::size_t kMostLines = 50;
/// KITTI's scans: x, y, z, intensity of each point as float32, and nothing else.
constexpr std::size_t kBytesPerPoint = 16;

/// By its ending, size and first points: there is no header.
bool isVelodyne(InputFile& file) {
  constexpr std::size_t kSample = 64;
  constexpr float kFarthest = 1e4f;  // metres
  const std::string& path = file.path();
  if (path.size() < 4 || path.compare(path.size() - 4, 4, ".bin") != 0) return false;
  if (file.size() == 0 || file.size() % kBytesPerPoint != 0) return false;
  std::array<float, 4 * kSample> values{};
  file.seek(0);
  const std::size_t count = file.read(values.data(), sizeof values) / sizeof(float);
  for (std::size_t i = 0; i < count; ++i)
    if (!(std::abs(values[i]) <= kFarthest)) return false;
  return true;
}

CloudData readVelodyne(const std::string& path, const CloudChannels& channels) {
  InputFile file(path);
  const std::size_t count = file.size() / kBytesPerPoint;
  if (count > std::numeric_limits<std::uint32_t>::max()) throw IoError(path, "has too many points");
  std::vector<float> values(4 * count);
  file.readExactly(values.data(), values.size() * sizeof(float));
  CloudData cloud;
  cloud.width = static_cast<std::uint32_t>(count);
  cloud.height = 1;
  cloud.xyz.reserve(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    cloud.xyz.insert(cloud.xyz.end(), {values[4 * i], values[4 * i + 1], values[4 * i + 2]});
    if (channels.intensities) cloud.intensities.push_back(values[4 * i + 3]);
  }
  return cloud;
}

CloudFileInfo readVelodyneInfo(const std::string& path) {
  CloudFileInfo info;
  info.format = CloudFormat::Velodyne;
  info.encoding = "binary";
  info.width = static_cast<std::uint32_t>(InputFile(path).size() / kBytesPerPoint);
  info.height = 1;
  info.fields = {"x", "y", "z", "intensity"};
  return info;
}

/// By content, as file names lie. PCD has no magic number: it begins with comments and a key.
CloudFormat formatOf(InputFile& file) {
  LineReader lines(file, kLongestLine);
  std::string_view line;
  try {
    for (std::size_t i = 0; i < kMostLines && lines.next(line); ++i) {
      const std::string_view word = takeWord(line);
      if (i == 0 && word == "ply") return CloudFormat::Ply;
      if (word == "VERSION" || word == "FIELDS" || word == "COLUMNS") return CloudFormat::Pcd;
      if (!word.empty() && word.front() != '#') break;
    }
  } catch (const IoError&) {
    // A line too long for a header: no text file.
  }
  return isVelodyne(file) ? CloudFormat::Velodyne : CloudFormat::None;
}

CloudFormat requireFormat(const std::string& path) {
  InputFile file(path);
  if (file.size() == 0) throw IoError(path, "is empty");
  const CloudFormat format = formatOf(file);
  if (format == CloudFormat::None)
    throw IoError(path, "is neither a PCD nor a PLY file, nor a KITTI scan (.bin)");
  return format;
}

}  // namespace

CloudFormat recognizeCloudFile(const std::string& path) {
  try {
    InputFile file(path);
    return formatOf(file);
  } catch (const IoError&) {
    return CloudFormat::None;
  }
}

CloudData readCloudFile(const std::string& path, const CloudChannels& channels) {
  const CloudFormat format = requireFormat(path);
  CloudData cloud = format == CloudFormat::Pcd   ? readPcd(path, channels)
                    : format == CloudFormat::Ply ? readPly(path, channels)
                                                 : readVelodyne(path, channels);
  cloud.origin = cloud.origin.array().isNaN().select(0.0, cloud.origin);
  cloud.T_world_sensor.translate(cloud.origin);
  return cloud;
}

CloudFileInfo readCloudFileInfo(const std::string& path) {
  const CloudFormat format = requireFormat(path);
  return format == CloudFormat::Pcd   ? readPcdInfo(path)
         : format == CloudFormat::Ply ? readPlyInfo(path)
                                      : readVelodyneInfo(path);
}

}  // namespace planar_mapping::io
