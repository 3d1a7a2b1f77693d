// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace planar_mapping::visualization {

enum class XDisplayState { Usable, NoServer, NoOpenGl };

/// Opens the display of DISPLAY and asks for a visual VTK can use. A usable one stays open.
XDisplayState probeXDisplay();

}  // namespace planar_mapping::visualization
