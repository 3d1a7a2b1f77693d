// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/core/cuboids/raster/detail/plane_raster.h"

namespace planar_mapping::detail {

/// \throws InputError if the number of cells is not width x height
void requireConsistent(const CellMask& mask);

}  // namespace planar_mapping::detail
