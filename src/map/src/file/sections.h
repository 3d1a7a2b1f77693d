// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "file/map_record.h"

namespace planar_mapping::detail {

/// The named sections of a map file, one after the other (docs/file_format.md, "Sections").
/// \throws Error if a value is beyond what a file may hold, which no map reaches
std::vector<std::uint8_t> sectionsOf(MapRecord record);
/// \throws Error naming the section and what is wrong
MapRecord recordOfSections(const std::vector<std::uint8_t>& sections, bool is_finished);

}  // namespace planar_mapping::detail
