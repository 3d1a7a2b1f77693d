// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace planar_mapping {

/// How long a cover is improved.
enum class CoverEffort : std::uint8_t {
  Quick,  ///< no fewer boxes than with the next
  Full,   ///< the cells of each part alone never need fewer boxes than these are
};

}  // namespace planar_mapping
