// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace planar_mapping {

/// How long a cover is improved.
enum class CoverEffort : std::uint8_t {
  Quick,  ///< no fewer boxes than with the next
  Full,   ///< a search for fewer boxes than the first ones
};

}  // namespace planar_mapping
