// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkRenderWindow.h>

#include "planar_mapping/visualization/image.h"

namespace planar_mapping::visualization {

constexpr int kSamplesPerPixel = 4;

/// What was rendered last.
Image imageOf(vtkRenderWindow* window);

}  // namespace planar_mapping::visualization
