// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/cloud_file.h"

#include <string_view>

#include "cloud_formats.h"
#include "input_file.h"
#include "planar_mapping/core/base/error.h"
#include "text_lines.h"

namespace planar_mapping {
namespace io {
namespace {

constexpr std::size_t kLongestLine = 4096;
constexpr std::size_t kMostLines = 50;

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

}  // namespace io
}  // namespace planar_mapping
