// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/cloud_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string_view>
#include <utility>

#include "planar_mapping/io/cloud_layout.h"
#include "planar_mapping/io/input_file.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io {
namespace {

constexpr std::size_t kLongestLine = 4096;
constexpr std::size_t kMaxLines = 50;
/// Scans without a header: x, y, z, intensity of each point as float32 (KITTI), and for some the
/// number of its ring, too (nuScenes).
constexpr std::size_t kKittiNumbers = 4;
constexpr std::size_t kRingNumbers = 5;

/// How far the columns of rows of so many numbers spread, as the mean logarithm of their variances:
/// least for the right number, as wrong rows mix columns.
double spreadOf(const std::vector<float>& values, std::size_t numbers) {
  constexpr double kLeast = 1e-6;  // the least variance that tells anything
  double sum = 0.0;
  for (std::size_t column = 0; column < numbers; ++column) {
    double count = 0.0, mean = 0.0, squares = 0.0;
    for (std::size_t i = column; i < values.size(); i += numbers) {
      const double off = double{values[i]} - mean;
      mean += off / ++count;
      squares += off * (double{values[i]} - mean);
    }
    sum += std::log(squares / std::max(1.0, count) + kLeast);
  }
  return sum / static_cast<double>(numbers);
}

/// Whether points of a scan can be of so many numbers each: all but one in fifty.
/// \param rings  gets those that occur
bool holdsScan(const std::vector<float>& values, std::size_t numbers, std::set<float>& rings) {
  constexpr float kFarthest = 1e4f;  // metres
  constexpr float kMaxRings = 256.0f;
  constexpr std::size_t kMaxOdd = 50;
  std::size_t odd = 0;
  for (std::size_t i = 0; i + numbers <= values.size(); i += numbers) {
    const auto isNear = [&](std::size_t k) { return std::abs(values[i + k]) <= kFarthest; };
    const float intensity = values[i + 3];
    bool fits = isNear(0) && isNear(1) && isNear(2) && intensity >= 0.0f && intensity <= kFarthest;
    if (numbers == kRingNumbers) {
      const float ring = values[i + 4];
      fits = fits && ring >= 0.0f && ring < kMaxRings && ring == std::floor(ring);
      if (fits) rings.insert(ring);
    }
    odd += fits ? 0 : 1;
  }
  return kMaxOdd * odd * numbers <= values.size();
}

/// Whether rows of another length explain the values clearly better.
bool hasOtherRows(const std::vector<float>& values, std::size_t numbers) {
  constexpr double kClearly = 0.5;
  constexpr std::size_t kFewestRows = 16;
  const double spread = spreadOf(values, numbers);
  for (const std::size_t other : {3, 4, 5, 6, 7})
    if (values.size() >= kFewestRows * other && spreadOf(values, other) < spread - kClearly)
      return true;
  return false;
}

/// By its ending, its size and points of its beginning, middle and end. \return numbers of a point;
/// 0 if it is no scan
std::size_t scanNumbers(InputFile& file) {
  constexpr std::size_t kBoth = kKittiNumbers * kRingNumbers;  // whole points of both kinds
  constexpr std::size_t kSample = 64 * kBoth;
  const std::string& path = file.path();
  if (path.size() < 4 || path.compare(path.size() - 4, 4, ".bin") != 0) return 0;
  if (file.size() == 0) return 0;
  std::vector<std::vector<float>> samples;
  for (const std::size_t part : {0, 1, 2}) {
    const std::size_t blocks = file.size() / (kBoth * sizeof(float));
    const std::size_t first = part * (blocks - std::min(blocks, kSample / kBoth)) / 2;
    file.seek(first * kBoth * sizeof(float));
    std::vector<float> values(kSample);
    values.resize(file.read(values.data(), kSample * sizeof(float)) / sizeof(float));
    samples.push_back(std::move(values));
  }
  for (const std::size_t numbers : {kRingNumbers, kKittiNumbers}) {
    std::set<float> rings;
    const bool fits = std::all_of(samples.begin(), samples.end(), [&](const auto& values) {
      return holdsScan(values, numbers, rings);
    });
    if (file.size() % (numbers * sizeof(float)) == 0 && fits &&
        !hasOtherRows(samples.front(), numbers) && (numbers == kKittiNumbers || rings.size() > 1)) {
      return numbers;
    }
  }
  return 0;
}

CloudData readVelodyne(const std::string& path, const CloudChannels& channels) {
  InputFile file(path);
  const std::size_t numbers = scanNumbers(file);
  const std::size_t count = file.size() / (numbers * sizeof(float));
  if (count > std::numeric_limits<std::uint32_t>::max()) throw IoError(path, "has too many points");
  std::vector<float> values(numbers * count);
  file.seek(0);
  file.readExactly(values.data(), values.size() * sizeof(float));
  CloudData cloud;
  cloud.width = static_cast<std::uint32_t>(count);
  cloud.height = 1;
  cloud.xyz.reserve(3 * count);
  for (std::size_t i = 0; i < values.size(); i += numbers) {
    cloud.xyz.insert(cloud.xyz.end(), {values[i], values[i + 1], values[i + 2]});
    if (channels.intensities) cloud.intensities.push_back(values[i + 3]);
  }
  return cloud;
}

CloudFileInfo readVelodyneInfo(const std::string& path) {
  CloudFileInfo info;
  info.format = CloudFormat::Velodyne;
  info.encoding = "binary";
  InputFile file(path);
  const std::size_t numbers = scanNumbers(file);
  info.width = static_cast<std::uint32_t>(file.size() / (numbers * sizeof(float)));
  info.height = 1;
  info.fields = {"x", "y", "z", "intensity"};
  if (numbers == kRingNumbers) info.fields.emplace_back("ring");
  return info;
}

/// By content, as file names lie. PCD has no magic number: it begins with comments and a key.
CloudFormat formatOf(InputFile& file) {
  LineReader lines(file, kLongestLine);
  std::string_view line;
  try {
    for (std::size_t i = 0; i < kMaxLines && lines.next(line); ++i) {
      const std::string_view word = takeWord(line);
      if (i == 0 && word == "ply") return CloudFormat::Ply;
      if (word == "VERSION" || word == "FIELDS" || word == "COLUMNS") return CloudFormat::Pcd;
      if (!word.empty() && word.front() != '#') break;
    }
  } catch (const IoError&) {
    // A line too long for a header: no text file.
  }
  return scanNumbers(file) > 0 ? CloudFormat::Velodyne : CloudFormat::None;
}

/// Along axes on which a cloud is no farther from 0 than it is large, its coordinates stay those of
/// the file: it is large, not far away.
void keepNearOrigins(CloudData& cloud) {
  constexpr std::size_t kSample = 100000;
  constexpr double kOutliers = 0.01;  // at either end
  if (cloud.origin.isZero(0.0)) return;
  Vector3 low = Vector3::Zero();
  Vector3 high = Vector3::Zero();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (std::size_t i = 0; i < cloud.size(); i += cloud.size() / kSample + 1) {
      const double value = cloud.xyz[3 * i + static_cast<std::size_t>(axis)];
      if (std::isfinite(value)) values.push_back(value + cloud.origin[axis]);
    }
    if (values.empty()) return;
    std::sort(values.begin(), values.end());
    const auto ends = static_cast<std::size_t>(kOutliers * static_cast<double>(values.size()));
    low[axis] = values[ends];
    high[axis] = values[values.size() - 1 - ends];
  }
  const double extent = (high - low).maxCoeff();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (std::max(low[axis], -high[axis]) > extent) continue;
    for (std::size_t i = static_cast<std::size_t>(axis); i < cloud.xyz.size(); i += 3)
      cloud.xyz[i] = static_cast<float>(cloud.xyz[i] + cloud.origin[axis]);
    cloud.origin[axis] = 0.0;
  }
}

CloudFormat requireFormat(const std::string& path) {
  InputFile file(path);
  if (file.size() == 0) throw IoError(path, "is empty");
  const CloudFormat format = formatOf(file);
  if (format == CloudFormat::None)
    throw IoError(path,
                  "is neither a PCD nor a PLY file, nor a scan of KITTI or nuScenes (.bin); PDAL "
                  "or CloudCompare write PLY from LAS, E57 and others");
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
  keepNearOrigins(cloud);
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
