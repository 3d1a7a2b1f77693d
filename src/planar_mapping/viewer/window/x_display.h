// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace planar_mapping::visualization {

/// Empty if a VTK window can be opened on the X server of DISPLAY, which then stays open, else what
/// is missing. VTK calls abort() when it finds out by itself, so that this has to come first.
std::string xServerProblem();

}  // namespace planar_mapping::visualization
