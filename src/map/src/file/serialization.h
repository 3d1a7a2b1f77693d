// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "store/map_data.h"

namespace planar_mapping::detail {

/// The bytes of docs/file_format.md.
std::vector<std::uint8_t> serializeMap(const MapData& map);
/// \throws Error naming what is wrong
MapData deserializeMap(const std::uint8_t* data, std::size_t size);

/// The map of a file of version 2, from behind the version on.
/// \throws Error naming what is wrong
MapData readVersion2(const std::uint8_t* data, std::size_t size);

/// CRC-32 of zlib and PNG (polynomial 0xEDB88320, reflected).
std::uint32_t crc32(const std::uint8_t* data, std::size_t size);

}  // namespace planar_mapping::detail
