// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace planar_mapping::tools {

/// `planar_map_viewer charts DIR`, which `planar_map evaluate` starts: the figures of the tables in
/// DIR, drawn into it. \return exit code; throws our errors
int runCharts(int argc, char** argv);

}  // namespace planar_mapping::tools
