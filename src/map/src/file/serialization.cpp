// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/serialization.h"

#include <cstring>

#include "file/bit_stream.h"
#include "file/file_frame.h"
#include "file/record_coder.h"

namespace planar_mapping::detail {
namespace {

constexpr FileFrame kFrame{{'P', 'M', 'A', 'P'}, 4, "versions 2 and 4"};
/// What stood in place of the version up to version 3, before it.
constexpr std::uint8_t kMagicBefore4[4] = {'\r', '\n', 0x1a, '\n'};

/// Reads a file of a version before 4.
MapData readOlder(const std::uint8_t* data, std::size_t size) {
  ByteReader in(data, size, "the map");
  in.take(sizeof kFrame.magic + sizeof kMagicBefore4);
  const std::uint32_t version = in.u32();
  if (version != 2) kFrame.failForVersion(version);
  const std::size_t left = in.left();
  return readVersion2(in.take(left), left);
}

MapData readVersion4(const std::uint8_t* data, std::size_t size) {
  BitCoder coder = kFrame.open(data, size);
  MapRecord record;
  coder.finishReading(RecordCoder::experienced().code(coder, record));
  return mapOf(record);
}

}  // namespace

std::vector<std::uint8_t> serializeMap(const MapData& map) {
  MapRecord record = recordOf(map);
  BitCoder coder;
  const std::size_t fewest = RecordCoder::experienced().code(coder, record);
  return kFrame.around(coder.finish(fewest));
}

MapData deserializeMap(const std::uint8_t* data, std::size_t size) {
  if (!kFrame.starts(data, size)) throw Error("this is no planar map: it does not start as one");
  constexpr std::size_t kStart = sizeof kFrame.magic;
  const bool is_older = size >= kStart + sizeof kMagicBefore4 &&
                        std::memcmp(data + kStart, kMagicBefore4, sizeof kMagicBefore4) == 0;
  return is_older ? readOlder(data, size) : readVersion4(data, size);
}

}  // namespace planar_mapping::detail
