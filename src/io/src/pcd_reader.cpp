// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <lzf.h>

#include <cstring>
#include <memory>

#include "cloud_formats.h"
#include "pcd_header.h"
#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace io {
namespace {

constexpr std::size_t kLongestHeaderLine = std::size_t{1} << 16;
constexpr std::size_t kLongestDataLine = std::size_t{1} << 24;
/// LZF's longest match: 264 bytes out of 3.
constexpr std::uint64_t kLargestExpansion = 88;

void checkSurplus(const std::string& path, std::uint64_t points, std::uint64_t surplus,
                  std::size_t record_size) {
  if (surplus >= record_size)
    throw IoError(path, "header lies: it announces " + std::to_string(points) + " points, but " +
                            std::to_string(surplus) + " more bytes follow them");
}

void readCompressed(CloudData& cloud, const CloudFiller& filler, const PcdHeader& header,
                    InputFile& file) {
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
  filler.allocate(cloud, header.width, header.height, plain_size, false);
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
}

}  // namespace

CloudData readPcd(const std::string& path, const CloudChannels& channels) {
  InputFile file(path);
  LineReader lines(file, kLongestHeaderLine);
  const PcdHeader header = readPcdHeader(path, lines);
  const CloudFiller filler(path, header.fields, channels);
  const std::uint64_t bytes_left = file.size() - std::min(file.size(), header.data_position);

  CloudData cloud;
  cloud.T_world_sensor = header.T_world_sensor;
  if (header.encoding == "ascii") {
    filler.allocate(cloud, header.width, header.height, bytes_left, true);
    lines.setLongestLine(kLongestDataLine);
    filler.fillLines(cloud, lines);
    std::string_view line;
    while (lines.next(line))
      if (!takeWord(line).empty())
        throw IoError(path, "line " + std::to_string(lines.number()) +
                                ": more points than the announced " + std::to_string(cloud.size()));
    return cloud;
  }
  file.seek(header.data_position);
  if (header.encoding == "binary") {
    filler.allocate(cloud, header.width, header.height, bytes_left, false);
    checkSurplus(path, cloud.size(), bytes_left - cloud.size() * filler.recordSize(),
                 filler.recordSize());
    filler.fillFromFile(cloud, file, false);
  } else {
    readCompressed(cloud, filler, header, file);
  }
  return cloud;
}

CloudFileInfo readPcdInfo(const std::string& path) {
  InputFile file(path);
  LineReader lines(file, kLongestHeaderLine);
  const PcdHeader header = readPcdHeader(path, lines);
  const CloudFiller filler(path, header.fields, CloudChannels::none());
  CloudFileInfo info;
  info.format = CloudFormat::Pcd;
  info.encoding = header.encoding;
  info.T_world_sensor = header.T_world_sensor;
  for (const CloudField& field : header.fields) info.fields.push_back(field.name);
  std::uint64_t bytes = file.size() - std::min(file.size(), header.data_position);
  if (header.encoding == "binary_compressed") bytes *= kLargestExpansion;
  filler.checkSize(header.width, header.height, bytes, header.encoding == "ascii");
  info.width = static_cast<std::uint32_t>(header.width);
  info.height = static_cast<std::uint32_t>(header.height);
  return info;
}

}  // namespace io
}  // namespace planar_mapping
