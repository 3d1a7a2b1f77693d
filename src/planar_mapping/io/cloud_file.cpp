// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/cloud_file.h"

#include <lzf.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string_view>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/io/cloud_layout.h"
#include "planar_mapping/io/input_file.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io {
namespace {

/// Bytes of a line of a header: fields of points may be many.
constexpr std::size_t kLongestHeaderLine = std::size_t{1} << 16;
/// LZF's longest match: 264 bytes out of 3.
constexpr std::uint64_t kLargestExpansion = 88;

/// By its first lines, as file names lie; a scan has no header, its name ends in .bin. PCD has no
/// magic number: it begins with comments and a key.
CloudFormat formatOf(InputFile& file) {
  constexpr std::size_t kLongestLine = 4096;  // bytes; longer is no text
  constexpr std::size_t kMaxLines = 50;       // of comments before the first key
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
  const std::string_view path = file.path();
  constexpr std::string_view kScan = ".bin";
  const bool is_scan =
      path.size() > kScan.size() && path.substr(path.size() - kScan.size()) == kScan;
  return is_scan && file.size() > 0 ? CloudFormat::Velodyne : CloudFormat::None;
}

/// Scans without a header: x, y, z, intensity of each point as float32 (KITTI, *.bin), and the
/// number of the ring (nuScenes, *.pcd.bin).
CloudHeader scanHeader(const InputFile& file) {
  CloudHeader header;
  header.format = CloudFormat::Velodyne;
  header.encoding = "binary";
  for (const char* name : {"x", "y", "z", "intensity"})
    header.fields.push_back({name, {'F', 4}, 1});
  if (file.path().find(".pcd.bin") != std::string::npos)
    header.fields.push_back({"ring", {'F', 4}, 1});
  const std::uint64_t record = sizeof(float) * header.fields.size();
  if (file.size() % record != 0)
    throw IoError(file.path(),
                  "is no scan of KITTI (x, y, z, intensity as float32) nor, as "
                  "*.pcd.bin, of nuScenes (with the ring): its size is no multiple "
                  "of " +
                      std::to_string(record) + " bytes");
  header.width = file.size() / record;
  return header;
}

CloudHeader readHeader(InputFile& file, LineReader& lines) {
  if (file.size() == 0) throw IoError(file.path(), "is empty");
  const CloudFormat format = formatOf(file);
  file.seek(0);
  if (format == CloudFormat::Pcd) return readPcdHeader(file, lines);
  if (format == CloudFormat::Ply) return readPlyHeader(file, lines);
  if (format == CloudFormat::Velodyne) return scanHeader(file);
  throw IoError(file.path(),
                "is neither a PCD nor a PLY file, nor a scan of KITTI or nuScenes (.bin); PDAL or "
                "CloudCompare write PLY from LAS, E57, text and others");
}

/// What follows the points, at the file's position. Some versions of PCL leave up to a
/// page of memory of zeros there.
void checkSurplus(InputFile& file, std::uint64_t points, std::size_t record_size) {
  constexpr std::uint64_t kPage = 65536;  // the largest in use
  const std::uint64_t surplus = file.size() - file.position();
  if (surplus < record_size) return;
  std::vector<char> rest(std::min(surplus, kPage));
  file.readExactly(rest.data(), rest.size());
  const bool is_padding =
      surplus < kPage && std::all_of(rest.begin(), rest.end(), [](char c) { return c == 0; });
  if (is_padding) return;
  throw IoError(file.path(), "header lies: it announces " + std::to_string(points) +
                                 " points, but " + std::to_string(surplus) +
                                 " more bytes follow them");
}

CloudData readCompressed(const CloudFiller& filler, const CloudHeader& header, InputFile& file) {
  const std::string& path = file.path();
  std::uint32_t sizes[2];
  file.readExactly(sizes, sizeof sizes);
  const std::uint64_t packed_size = sizes[0];
  const std::uint64_t plain_size = sizes[1];
  if (packed_size > file.size() - file.position())
    throw IoError(path, "is cut short: " + std::to_string(packed_size) +
                            " compressed bytes announced, " +
                            std::to_string(file.size() - file.position()) + " there");
  if (plain_size / kLargestExpansion > packed_size)
    throw IoError(path, "is damaged: " + std::to_string(packed_size) +
                            " compressed bytes cannot hold " + std::to_string(plain_size));
  CloudData cloud = filler.allocate(header, plain_size);
  if (plain_size != std::uint64_t{cloud.size()} * filler.recordSize())
    throw IoError(path, "contradicts itself: " + std::to_string(plain_size) +
                            " uncompressed bytes for " + std::to_string(cloud.size()) +
                            " points of " + std::to_string(filler.recordSize()) + " bytes");
  // Plain arrays: a vector would clear what is about to be overwritten.
  std::unique_ptr<std::uint8_t[]> packed(new std::uint8_t[packed_size]);
  file.readExactly(packed.get(), packed_size);
  std::unique_ptr<std::uint8_t[]> plain(new std::uint8_t[plain_size]);
  const unsigned done = lzf_decompress(packed.get(), static_cast<unsigned>(packed_size),
                                       plain.get(), static_cast<unsigned>(plain_size));
  if (done != plain_size) throw IoError(path, "is damaged: its points cannot be decompressed");
  packed.reset();
  filler.fillTransposed(cloud, plain.get());
  return cloud;
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
  InputFile file(path);
  LineReader lines(file, kLongestHeaderLine);
  const CloudHeader header = readHeader(file, lines);
  const CloudFiller filler(path, header.fields, channels);
  const std::uint64_t bytes_left = file.size() - std::min(file.size(), header.data_position);
  const bool is_pcd = header.format == CloudFormat::Pcd;
  CloudData cloud;
  if (header.isAscii()) {
    cloud = filler.allocate(header, bytes_left);
    lines.setLongestLine(kLongestDataLine);
    filler.fillLines(cloud, lines);
    std::string_view line;
    while (is_pcd && lines.next(line))
      if (!takeWord(line).empty())
        failAtLine(path, lines.number(),
                   "more points than the announced " + std::to_string(cloud.size()));
  } else {
    file.seek(header.data_position);
    if (header.encoding == "binary_compressed") {
      cloud = readCompressed(filler, header, file);
    } else {
      cloud = filler.allocate(header, bytes_left);
      filler.fillFromFile(cloud, file, header.encoding == "binary_big_endian");
      if (is_pcd) checkSurplus(file, cloud.size(), filler.recordSize());
    }
  }
  cloud.origin = cloud.origin.array().isNaN().select(0.0, cloud.origin);
  keepNearOrigins(cloud);
  cloud.T_world_sensor.translate(cloud.origin);
  return cloud;
}

void scaleCloud(CloudData& cloud, double scale) {
  for (float& value : cloud.xyz) value = static_cast<float>(scale * value);
  cloud.origin *= scale;
  cloud.T_world_sensor.translation() *= scale;
}

void placeSensor(CloudData& cloud, const Vector3& position) {
  cloud.xyz = seenFrom(position - cloud.origin, cloud.view());
  cloud.origin.setZero();
  cloud.T_world_sensor = Eigen::Translation3d(position);
}

CloudFileInfo readCloudFileInfo(const std::string& path) {
  InputFile file(path);
  LineReader lines(file, kLongestHeaderLine);
  const CloudHeader header = readHeader(file, lines);
  std::uint64_t bytes = file.size() - std::min(file.size(), header.data_position);
  if (header.encoding == "binary_compressed") bytes *= kLargestExpansion;
  CloudFiller(path, header.fields, CloudChannels::none()).checkSize(header, bytes);
  CloudFileInfo info;
  info.format = header.format;
  info.encoding = header.encoding;
  info.T_world_sensor = header.T_world_sensor;
  info.width = static_cast<std::uint32_t>(header.width);
  info.height = static_cast<std::uint32_t>(header.height);
  for (const CloudField& field : header.fields) info.fields.push_back(field.name);
  return info;
}

}  // namespace planar_mapping::io
