// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "evaluation_run.h"

namespace planar_mapping::tools {

/// The maps of SG and of ours at one place, cut into what is right and what is wrong, as JSON for
/// the picture (the paper, Fig. 9). Cuboids with anything wrong about them are cut into parts of at
/// most a cell; a part is wrong if its centre is farther than a cell from the true surface.
/// \param maps  with truth
std::string artefactJson(const PlaceMaps& maps, const std::string& scene);

}  // namespace planar_mapping::tools
