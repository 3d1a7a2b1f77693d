// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What the graphics driver keeps until the process ends is not our leak, and its threads are not
// instrumented.
extern "C" __attribute__((used, visibility("default"))) const char* __lsan_default_suppressions() {
  return "leak:libEGL\nleak:libGL\nleak:_dri.so\nleak:libLLVM\nleak:libX11\nleak:libfontconfig\n"
         "leak:libvtk\n";
}
extern "C" __attribute__((used, visibility("default"))) const char* __tsan_default_suppressions() {
  return "race:_dri.so\nrace:libLLVM\nrace:libvtk\ncalled_from_lib:_dri.so\n";
}
