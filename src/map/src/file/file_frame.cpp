// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/file_frame.h"

#include <cstring>
#include <string>
#include <utility>

#include "file/bit_stream.h"
#include "file/serialization.h"

namespace planar_mapping::detail {

std::vector<std::uint8_t> FileFrame::around(const std::vector<std::uint8_t>& payload) const {
  ByteWriter out;
  out.bytes.assign(std::begin(magic), std::end(magic));
  out.u8(version);
  out.u32(crc32(payload.data(), payload.size()));
  out.bytes.insert(out.bytes.end(), payload.begin(), payload.end());
  return std::move(out.bytes);
}

bool FileFrame::starts(const std::uint8_t* data, std::size_t size) const {
  return size >= sizeof magic && std::memcmp(data, magic, sizeof magic) == 0;
}

bool FileFrame::isOfThisVersion(const std::uint8_t* data, std::size_t size) const {
  return size > sizeof magic && data[sizeof magic] == version;
}

BitCoder FileFrame::open(const std::uint8_t* data, std::size_t size) const {
  ByteReader in(data, size, "the map");
  in.take(sizeof magic);
  const std::uint8_t found = in.u8();
  if (found != version) failForVersion(found);
  const std::uint32_t checksum = in.u32();
  const std::size_t length = in.left();
  const std::uint8_t* payload = in.take(length);
  if (crc32(payload, length) != checksum) {
    throw Error("the map is cut short or damaged: its checksum does not match");
  }
  return {payload, length, "the map"};
}

void FileFrame::failForVersion(std::uint32_t found) const {
  throw Error("this planar map has version " + std::to_string(found) + "; only " + readable +
              " can be read");
}

}  // namespace planar_mapping::detail
