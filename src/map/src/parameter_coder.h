// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "bit_coder.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::detail {

/// All 64 bits of a number.
double codeDouble(BitCoder& coder, double value);
/// The parameters of a map (docs/file_format.md, "Content"). \throws Error, ParameterError
void codeParams(BitCoder& coder, PlanarMapParams& p);

}  // namespace planar_mapping::detail
