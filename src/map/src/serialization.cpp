// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "serialization.h"

#include <cstring>
#include <string>

#include "bit_coder.h"
#include "bit_stream.h"
#include "map_record.h"

namespace planar_mapping::detail {
namespace {

constexpr std::uint8_t kMagic[8] = {'P', 'M', 'A', 'P', '\r', '\n', 0x1a, '\n'};
constexpr std::uint32_t kVersion = 3;

}  // namespace

std::vector<std::uint8_t> serializeMap(const MapData& map) {
  MapRecord record = recordOf(map);
  BitCoder coder;
  const std::size_t fewest = codeRecord(coder, record);
  const std::vector<std::uint8_t> payload = coder.finish(fewest);
  if (payload.size() > UINT32_MAX) throw Error("the map is too large for a file");
  ByteWriter out;
  out.bytes.assign(std::begin(kMagic), std::end(kMagic));
  out.u32(kVersion);
  out.u32(crc32(payload.data(), payload.size()));
  out.u32(static_cast<std::uint32_t>(payload.size()));
  out.bytes.insert(out.bytes.end(), payload.begin(), payload.end());
  return std::move(out.bytes);
}

MapData deserializeMap(const std::uint8_t* data, std::size_t size) {
  ByteReader in(data, size, "the map");
  if (size < sizeof kMagic || std::memcmp(data, kMagic, sizeof kMagic) != 0) {
    throw Error("this is no planar map: it does not start as one");
  }
  in.take(sizeof kMagic);
  const std::uint32_t version = in.u32();
  if (version != 2 && version != kVersion) {
    throw Error("this planar map has version " + std::to_string(version) +
                "; only versions 2 and " + std::to_string(kVersion) + " can be read");
  }
  MapData map;
  if (version == 2) {
    const std::size_t left = in.left();
    map = readVersion2(in.take(left), left);
  } else {
    const std::uint32_t checksum = in.u32();
    const std::size_t length = in.u32();
    if (length > in.left()) throw Error("the map is cut short or damaged: bytes are missing");
    const std::uint8_t* payload = in.take(length);
    in.end();
    if (crc32(payload, length) != checksum) {
      throw Error("the map is damaged: its checksum does not match");
    }
    BitCoder coder(payload, length, "the map");
    MapRecord record;
    coder.finishReading(codeRecord(coder, record));
    map = mapOf(record);
  }
  FrameUpdate update;
  tidyMap(map, update);
  return map;
}

}  // namespace planar_mapping::detail
