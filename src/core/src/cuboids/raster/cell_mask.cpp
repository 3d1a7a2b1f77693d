// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/raster/cell_mask.h"

#include <string>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::detail {

void requireConsistent(const CellMask& mask) {
  if (mask.width >= 0 && mask.height >= 0 &&
      mask.cells.size() == static_cast<std::size_t>(mask.width) * mask.height) {
    return;
  }
  throw InputError("cell mask of " + std::to_string(mask.width) + " x " +
                   std::to_string(mask.height) + " holds " + std::to_string(mask.cells.size()) +
                   " cells");
}

}  // namespace planar_mapping::detail
