// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

namespace planar_mapping::detail {

/// Maps of simulated scenes, coded one after the other by a coder that starts without experience
/// (docs/file_format.md, "Prior maps"). They are part of the format.
extern const std::uint8_t kPriorMaps[];
extern const std::size_t kPriorMapsSize;
extern const std::size_t kPriorMapCount;

/// The same of finished maps (docs/finished_map.md).
extern const std::uint8_t kPriorFinishedMaps[];
extern const std::size_t kPriorFinishedMapsSize;
extern const std::size_t kPriorFinishedMapCount;

}  // namespace planar_mapping::detail
