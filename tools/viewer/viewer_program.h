// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace planar_mapping::tools {

/// Becomes the viewer that was built or installed beside this program, so that its exit code is
/// ours and planar_map itself needs no VTK. \throws RenderError if there is none
[[noreturn]] void becomeViewer(const std::vector<std::string>& arguments);
/// Starts it and waits for it. \return its exit code. \throws RenderError if there is none
int runViewer(const std::vector<std::string>& arguments);

}  // namespace planar_mapping::tools
