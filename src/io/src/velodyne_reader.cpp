// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "cloud_formats.h"
#include "input_file.h"
#include "planar_mapping/core/base/error.h"

// KITTI's scans: x, y, z, intensity of each point as float32, and nothing else.
namespace planar_mapping {
namespace io {
namespace {

constexpr std::size_t kBytesPerPoint = 16;

}  // namespace

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

}  // namespace io
}  // namespace planar_mapping
