// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/visualization/snapshot.h"

#include <vtkRenderer.h>

#include "planar_mapping/visualization/camera.h"
#include "scene/scene.h"
#include "window/window_image.h"

namespace planar_mapping {

Image renderSnapshot(const SceneContent& content, const ViewOptions& options) {
  content.validate();
  options.validate();
  const CameraView view = placeCamera(content, options);
  visualization::Scene scene(content);
  scene.show(options);
  scene.look(view);
  Image image = visualization::renderOffscreen(options.width, options.height, {scene.renderer()});
  visualization::requireDrawn(image);
  return image;
}

}  // namespace planar_mapping
