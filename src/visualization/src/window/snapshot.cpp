// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/visualization/snapshot.h"

#include <vtkRenderWindow.h>
#include <vtkRenderer.h>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/visualization/camera.h"
#include "window/render_backend.h"
#include "scene/scene.h"
#include "window/window_image.h"

namespace planar_mapping {

Image renderSnapshot(const SceneContent& content, const ViewOptions& options) {
  content.validate();
  options.validate();
  const CameraView view = placeCamera(content, options);
  const visualization::CapturedMessages messages;
  const auto screen = visualization::OffscreenWindow::create(options.width, options.height);
  vtkRenderWindow* window = screen->window();
  window->SetMultiSamples(visualization::kSamplesPerPixel);
  visualization::Scene scene(content);
  window->AddRenderer(scene.renderer());
  scene.show(options);
  scene.look(view);
  window->Render();
  if (const std::string error = messages.firstError(); !error.empty()) {
    throw RenderError("drawing failed (" + screen->name() + "): " + error);
  }
  Image image = visualization::imageOf(window);
  window->RemoveRenderer(scene.renderer());
  if (isBlank(image)) {
    throw RenderError("the picture came out blank (" + screen->name() +
                      "): nothing of the map is in view, or the graphics driver failed; try "
                      "another camera, or install libgl1-mesa-dri");
  }
  return image;
}

void saveSnapshot(const SceneContent& content, const ViewOptions& options, const std::string& path,
                  bool overwrite) {
  requireWritablePng(path, overwrite);
  writePng(renderSnapshot(content, options), path, overwrite);
}

}  // namespace planar_mapping
