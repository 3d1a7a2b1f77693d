// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkRenderWindow.h>

#include <vector>

#include "planar_mapping/visualization/image.h"

class vtkRenderer;

namespace planar_mapping::visualization {

constexpr int kSamplesPerPixel = 4;

/// What was rendered last.
Image imageOf(vtkRenderWindow* window);

/// Renders in a window off screen.
/// \throws RenderError if nothing here can draw, or VTK reports an error
Image renderOffscreen(int width, int height, const std::vector<vtkRenderer*>& renderers);
/// \throws RenderError for a picture of one colour
void requireDrawn(const Image& image);

}  // namespace planar_mapping::visualization
