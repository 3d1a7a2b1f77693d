// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace planar_mapping::detail {

/// CRC-32 of zlib and PNG (polynomial 0xEDB88320, reflected), of bytes after others.
inline std::uint32_t crc32(std::uint32_t before, const std::uint8_t* data, std::size_t size) {
  static const std::array<std::uint32_t, 256> table = [] {
    std::array<std::uint32_t, 256> made{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      made[i] = i;
      for (int bit = 0; bit < 8; ++bit) {
        made[i] = (made[i] & 1u) != 0 ? 0xEDB88320u ^ (made[i] >> 1u) : made[i] >> 1u;
      }
    }
    return made;
  }();
  std::uint32_t crc = ~before;
  for (std::size_t i = 0; i < size; ++i) crc = table[(crc ^ data[i]) & 0xffu] ^ (crc >> 8u);
  return ~crc;
}

}  // namespace planar_mapping::detail
