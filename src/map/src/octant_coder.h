// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "bit_coder.h"
#include "lattice_coder.h"

namespace planar_mapping::detail {

/// Which eighths of non-planar cells hold points (docs/file_format.md, "Non-planar cells"). Points
/// lie on surfaces, which go on in the next cells and in the other eighths of this one.
/// \param blocks  the cells, all of them known
/// \param octants one value for each of them, in their order
/// \throws Error if a cell that is read has no eighth
void codeOctants(BitCoder& coder, const std::vector<LatticeBundle>& blocks,
                 std::vector<std::uint8_t>& octants);

}  // namespace planar_mapping::detail
