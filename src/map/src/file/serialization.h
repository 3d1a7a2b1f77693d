// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "file/map_record.h"

namespace planar_mapping::detail {

/// The bytes of a file (docs/file_format.md).
std::vector<std::uint8_t> serializeMap(MapRecord record);
/// \throws Error naming what is wrong
MapRecord deserializeMap(const std::uint8_t* data, std::size_t size);

}  // namespace planar_mapping::detail
