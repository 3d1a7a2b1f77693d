// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

namespace planar_mapping::detail {

/// Numbers of cells, ascending.
using CellSet = std::vector<std::uint32_t>;

}  // namespace planar_mapping::detail
