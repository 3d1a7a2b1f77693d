// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "planar_mapping/base/crc32.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/map/file/columns.h"
#include "planar_mapping/map/file/map_record.h"

namespace planar_mapping::detail {
namespace {

constexpr char kMagic[4] = {'P', 'M', 'A', 'P'};
constexpr char kMagicOfOldFinished[4] = {'P', 'B', 'O', 'X'};
constexpr std::uint8_t kVersion = 5;
constexpr std::uint8_t kFinished = 1;  ///< flag
// The header: magic, version, flags, two bytes 0, bytes of the sections, CRC-32 of all else.
constexpr std::size_t kChecked = 16;
constexpr std::size_t kHeader = kChecked + 4;

constexpr int kCompressionLevel = 19;
/// Larger sections are compressed faster, to a fifth more: at the other level 8 MB take 2 to 6 s.
constexpr std::size_t kMaxForThat = std::size_t{3} << 20;
constexpr int kFastCompressionLevel = 6;
/// So many bytes of sections may come out of a file: a small one cannot take all memory.
constexpr std::uint64_t kFreeBytes = 1u << 20;
constexpr std::uint64_t kMaxRatio = 256;
/// A frame that says nothing: magic number and size, then so many bytes.
constexpr std::uint8_t kSkippable[4] = {0x50, 0x2a, 0x4d, 0x18};

std::uint32_t checksumOf(const std::uint8_t* file, std::size_t size) {
  return crc32(crc32(0, file, kChecked), file + kHeader, size - kHeader);
}

template <typename Number>
void put(Number value, std::uint8_t* at) {
  for (std::size_t b = 0; b < sizeof value; ++b)
    at[b] = static_cast<std::uint8_t>(value >> (8 * b));
}
template <typename Number>
Number get(const std::uint8_t* at) {
  Number value = 0;
  for (std::size_t b = 0; b < sizeof value; ++b) value |= static_cast<Number>(at[b]) << (8 * b);
  return value;
}

std::uint64_t mostSections(std::size_t file) {
  return kFreeBytes + kMaxRatio * file;
}

/// What a version before this one says of itself.
[[noreturn]] void failForVersion(const std::uint8_t* data, std::size_t size) {
  std::uint32_t version = data[4];
  if (version == '\r' && size >= 12) version = get<std::uint32_t>(data + 8);  // up to version 3
  throw Error("this planar map has version " + std::to_string(version) + "; only version " +
              std::to_string(kVersion) + " can be read: make the map anew");
}

}  // namespace

std::vector<std::uint8_t> serializeMap(MapRecord record) {
  const bool is_finished = record.is_finished;
  const std::vector<std::uint8_t> sections = sectionsOf(std::move(record));
  std::vector<std::uint8_t> file(kHeader + ZSTD_compressBound(sections.size()));
  const std::size_t size =
      ZSTD_compress(&file[kHeader], file.size() - kHeader, sections.data(), sections.size(),
                    sections.size() <= kMaxForThat ? kCompressionLevel : kFastCompressionLevel);
  if (ZSTD_isError(size) != 0) throw Error("the map cannot be compressed");
  file.resize(kHeader + size);
  if (sections.size() > mostSections(file.size())) {
    const std::size_t padding = (sections.size() - kFreeBytes) / kMaxRatio + 1 - file.size();
    file.insert(file.end(), std::begin(kSkippable), std::end(kSkippable));
    file.resize(file.size() + 4 + padding);
    put(static_cast<std::uint32_t>(padding), &file[kHeader + size + 4]);
  }
  std::copy(std::begin(kMagic), std::end(kMagic), file.begin());
  file[4] = kVersion;
  file[5] = is_finished ? kFinished : 0;
  put(std::uint64_t{sections.size()}, &file[8]);
  put(checksumOf(file.data(), file.size()), &file[kChecked]);
  return file;
}

MapRecord deserializeMap(const std::uint8_t* data, std::size_t size) {
  if (size > 4 && std::memcmp(data, kMagicOfOldFinished, 4) == 0) {
    throw Error("this is a finished map of an earlier version (pbox), which can no longer be read");
  }
  if (size <= 4 || std::memcmp(data, kMagic, 4) != 0) {
    throw Error("this is no planar map: it does not start as one");
  }
  if (data[4] != kVersion) failForVersion(data, size);
  if (size < kHeader || get<std::uint32_t>(data + kChecked) != checksumOf(data, size)) {
    throw Error("the map is cut short or damaged: its checksum does not match");
  }
  const std::uint64_t length = get<std::uint64_t>(data + 8);
  if (data[5] > kFinished || data[6] != 0 || data[7] != 0) {
    throw Error("the map has flags that this version does not know");
  }
  if (length > mostSections(size)) throw Error("the map claims to be too large for its file");
  std::vector<std::uint8_t> sections(static_cast<std::size_t>(length));
  const std::size_t found =
      ZSTD_decompress(sections.data(), sections.size(), data + kHeader, size - kHeader);
  if (ZSTD_isError(found) != 0 || found != length) {
    throw Error("the sections of the map cannot be decompressed");
  }
  return recordOfSections(sections, data[5] == kFinished);
}

}  // namespace planar_mapping::detail
