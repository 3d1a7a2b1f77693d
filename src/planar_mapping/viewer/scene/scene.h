// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkRenderer.h>
#include <vtkSmartPointer.h>

#include "planar_mapping/viewer/scene/camera.h"
#include "planar_mapping/viewer/scene/cuboid_layer.h"
#include "planar_mapping/viewer/scene/decorations.h"
#include "planar_mapping/viewer/scene/scene_content.h"
#include "planar_mapping/viewer/scene/view_options.h"

class vtkCamera;

namespace planar_mapping::visualization {

/// Puts a camera into a scene whose coordinates are relative to \p origin.
void place(const CameraView& view, const Vector3& origin, vtkCamera* camera);

/// Content as a VTK scene: the same for snapshots and the window.
class Scene {
 public:
  explicit Scene(const SceneContent& content);

  vtkRenderer* renderer() { return renderer_; }
  /// Colours, layers and background as the options say.
  void show(const ViewOptions& options);
  /// Puts the camera there.
  void look(const CameraView& view);
  /// Where the camera is now, also after the user moved it.
  CameraView camera() const;
  /// To be called after the camera was moved in other ways than look().
  void cameraMoved();
  /// A second outline around the picked cuboid; -1 for none.
  void highlight(int index);

 private:
  void recolor();
  void replace(Props& props, Props made, bool visible);

  const SceneContent& content_;
  ViewOptions options_;
  Vector3 origin_;
  GroundFrame ground_;
  vtkSmartPointer<vtkRenderer> renderer_;
  CuboidLayer planar_;
  CuboidLayer non_planar_;
  CuboidLayer unknown_;
  Captions captions_;  ///< what does not move with the camera
  Props grid_, ruler_, corner_axes_, trajectory_, clouds_, legend_, highlight_;
};

}  // namespace planar_mapping::visualization
