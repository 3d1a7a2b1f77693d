// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkActor.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <functional>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/cuboid.h"
#include "planar_mapping/viewer/scene/camera.h"
#include "planar_mapping/viewer/scene/colors.h"
#include "planar_mapping/viewer/scene/view_options.h"

namespace planar_mapping::visualization {

/// Many cuboids as one actor: a glyph mapper draws one cube per cuboid, turned and stretched.
///
/// Edges, height colours and the cutaway are done by the shaders, so that they cost nothing per
/// cuboid and follow the camera: edges are as wide as a line at any distance and fade where faces
/// get smaller than a few pixels.
class CuboidLayer {
 public:
  /// \param origin  subtracted before coordinates become float
  CuboidLayer(std::vector<Cuboid> cuboids, const Vector3& origin, const Vector3& up);

  vtkActor* actor() { return actor_; }
  std::size_t size() const { return cuboids_.size(); }
  /// One colour per cuboid.
  void setColors(const std::function<Color(const Cuboid&)>& color);
  /// Height colours that run over the faces instead of one colour per cuboid; null = off.
  void setHeightRange(const ScalarRange* range);
  void setEdges(bool visible);
  /// Draws a quarter of the colour, once, however many cuboids lie behind each other. Needs the
  /// four samples per pixel of kSamplesPerPixel.
  void setVeil();
  /// Leaves out what isCutAway() names; to be called whenever the camera moves.
  void setView(const CameraView& view, const ViewOptions& options);

 private:
  std::vector<Cuboid> cuboids_;
  Vector3 origin_;
  Vector3 up_;
  vtkSmartPointer<vtkPolyData> instances_;
  vtkSmartPointer<vtkActor> actor_;
};

}  // namespace planar_mapping::visualization
