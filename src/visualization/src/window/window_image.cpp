// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "window/window_image.h"

#include <vtkNew.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>

#include "planar_mapping/core/base/error.h"
#include "window/render_backend.h"

namespace planar_mapping::visualization {

Image imageOf(vtkRenderWindow* window) {
  const int* size = window->GetSize();
  Image image(size[0], size[1], Color{});
  vtkNew<vtkUnsignedCharArray> pixels;
  window->GetPixelData(0, 0, image.width - 1, image.height - 1, 0, pixels);
  const std::size_t row_bytes = 3 * static_cast<std::size_t>(image.width);
  if (static_cast<std::size_t>(pixels->GetNumberOfValues()) < image.rgb.size()) return image;
  for (int row = 0; row < image.height; ++row) {
    const unsigned char* from =
        pixels->GetPointer(static_cast<vtkIdType>(row_bytes) * (image.height - 1 - row));
    std::copy(from, from + row_bytes, image.rgb.data() + row_bytes * static_cast<std::size_t>(row));
  }
  return image;
}

Image renderOffscreen(int width, int height, const std::vector<vtkRenderer*>& renderers) {
  const CapturedMessages messages;
  const auto screen = OffscreenWindow::create(width, height);
  vtkRenderWindow* window = screen->window();
  window->SetMultiSamples(kSamplesPerPixel);
  for (vtkRenderer* renderer : renderers) window->AddRenderer(renderer);
  window->Render();
  if (const std::string error = messages.firstError(); !error.empty()) {
    throw RenderError("drawing failed (" + screen->name() + "): " + error);
  }
  Image image = imageOf(window);
  for (vtkRenderer* renderer : renderers) window->RemoveRenderer(renderer);
  return image;
}

void requireDrawn(const Image& image) {
  if (isBlank(image)) {
    throw RenderError(
        "the picture came out blank: nothing is in view, or the graphics driver failed; try "
        "another camera, or install libgl1-mesa-dri");
  }
}

}  // namespace planar_mapping::visualization
