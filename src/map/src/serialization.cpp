// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "serialization.h"

#include <cstring>
#include <string>

#include "bit_coder.h"
#include "bit_stream.h"
#include "record_coder.h"

namespace planar_mapping::detail {
namespace {

constexpr std::uint8_t kMagic[4] = {'P', 'M', 'A', 'P'};
constexpr std::uint8_t kVersion = 4;
/// What stood in place of the version up to version 3, before it.
constexpr std::uint8_t kMagicBefore4[4] = {'\r', '\n', 0x1a, '\n'};

[[noreturn]] void failForVersion(std::uint32_t version) {
  throw Error("this planar map has version " + std::to_string(version) + "; only versions 2 and " +
              std::to_string(kVersion) + " can be read");
}

MapData readVersion4(ByteReader& in) {
  const std::uint32_t checksum = in.u32();
  const std::size_t length = in.left();
  const std::uint8_t* payload = in.take(length);
  if (crc32(payload, length) != checksum) {
    throw Error("the map is cut short or damaged: its checksum does not match");
  }
  BitCoder coder(payload, length, "the map");
  MapRecord record;
  coder.finishReading(RecordCoder::experienced().code(coder, record));
  return mapOf(record);
}

}  // namespace

std::vector<std::uint8_t> serializeMap(const MapData& map) {
  MapRecord record = recordOf(map);
  BitCoder coder;
  const std::size_t fewest = RecordCoder::experienced().code(coder, record);
  const std::vector<std::uint8_t> payload = coder.finish(fewest);
  ByteWriter out;
  out.bytes.assign(std::begin(kMagic), std::end(kMagic));
  out.u8(kVersion);
  out.u32(crc32(payload.data(), payload.size()));
  out.bytes.insert(out.bytes.end(), payload.begin(), payload.end());
  return std::move(out.bytes);
}

MapData deserializeMap(const std::uint8_t* data, std::size_t size) {
  ByteReader in(data, size, "the map");
  if (size < sizeof kMagic || std::memcmp(data, kMagic, sizeof kMagic) != 0) {
    throw Error("this is no planar map: it does not start as one");
  }
  in.take(sizeof kMagic);
  MapData map;
  if (in.left() >= sizeof kMagicBefore4 &&
      std::memcmp(data + sizeof kMagic, kMagicBefore4, sizeof kMagicBefore4) == 0) {
    in.take(sizeof kMagicBefore4);
    const std::uint32_t version = in.u32();
    if (version != 2) failForVersion(version);
    const std::size_t left = in.left();
    map = readVersion2(in.take(left), left);
  } else {
    const std::uint8_t version = in.u8();
    if (version != kVersion) failForVersion(version);
    map = readVersion4(in);
  }
  FrameUpdate update;
  tidyMap(map, update);
  return map;
}

}  // namespace planar_mapping::detail
