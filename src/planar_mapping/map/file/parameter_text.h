// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "planar_mapping/map/store/planar_map_params.h"

namespace planar_mapping::detail {

/// The parameters of a map as lines of "name value" (docs/file_format.md, "PARAMS"). Numbers read
/// back as the same values. `threads` is a matter of the machine and is left out.
/// \param is_finished  then only those that queries depend on
std::string parameterText(const PlanarMapParams& params, bool is_finished);
/// \throws Error if a line is unknown; \throws ParameterError if a value is out of range
PlanarMapParams parametersOf(const std::string& text);

}  // namespace planar_mapping::detail
