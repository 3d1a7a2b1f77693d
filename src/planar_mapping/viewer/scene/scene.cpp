// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/scene/scene.h"

#include <vtkCamera.h>
#include <vtkLight.h>
#include <vtkLightCollection.h>

#include <cmath>

#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/viewer/scene/decorations.h"

namespace planar_mapping::visualization {
namespace {

std::vector<Cuboid> select(const std::vector<Cuboid>& cuboids, bool planar) {
  std::vector<Cuboid> chosen;
  for (const Cuboid& cuboid : cuboids) {
    if ((cuboid.plane_id >= 0) == planar) chosen.push_back(cuboid);
  }
  return chosen;
}

Vector3 middle(const SceneContent& content) {
  Vector3 low, high;
  return content.bounds(low, high) ? Vector3(0.5 * (low + high)) : Vector3::Zero();
}

void addLight(vtkRenderer* renderer, double right, double up, double back, double intensity) {
  vtkNew<vtkLight> light;
  light->SetLightTypeToCameraLight();
  light->SetPosition(right, up, back);
  light->SetFocalPoint(0.0, 0.0, 0.0);
  light->SetIntensity(intensity);
  renderer->AddLight(light);
}

bool isDark(const ViewOptions& options) {
  return options.background &&
         options.background->red + options.background->green + options.background->blue < 330;
}

}  // namespace

Scene::Scene(const SceneContent& content)
    : content_(content),
      origin_(middle(content)),
      ground_(groundFrame(content)),
      renderer_(vtkSmartPointer<vtkRenderer>::New()),
      planar_(select(content.cuboids, true), origin_, content.up),
      non_planar_(select(content.cuboids, false), origin_, content.up),
      unknown_(content.unknown, origin_, content.up) {
  // Lamps that move with the camera, from three sides: no face is black, no two look alike.
  renderer_->AutomaticLightCreationOff();
  addLight(renderer_, -0.45, 0.85, 0.6, 0.55);
  addLight(renderer_, 0.95, 0.2, 0.5, 0.34);
  addLight(renderer_, -0.5, 0.0, 0.85, 0.30);
  unknown_.setColors([](const Cuboid&) { return stateColor(CellState::Unknown); });
  unknown_.setVeil();
  for (CuboidLayer* layer : {&planar_, &non_planar_, &unknown_}) {
    if (layer->size() > 0) renderer_->AddActor(layer->actor());
  }
  trajectory_ = makeTrajectory(content, origin_);
  for (const SceneCloud& cloud : content.clouds) {
    for (auto& prop : makeCloud(cloud, origin_, options_.point_size)) clouds_.push_back(prop);
  }
  for (const auto& prop : trajectory_) renderer_->AddViewProp(prop);
  for (const auto& prop : clouds_) renderer_->AddViewProp(prop);
}

void Scene::replace(Props& props, Props made, bool visible) {
  for (const auto& prop : props) renderer_->RemoveViewProp(prop);
  props.clear();
  if (!visible) return;
  props = std::move(made);
  for (const auto& prop : props) renderer_->AddViewProp(prop);
}

void Scene::recolor() {
  const ScalarRange range = scalarRange(content_, options_.color);
  const auto color = [&](const Cuboid& cuboid) {
    if (options_.color == ColorBy::Plane) return planeColor(cuboid.plane_id);
    if (options_.color == ColorBy::State) return stateColor(cuboid.state);
    return scaleColor(options_.color,
                      range.normalized(scalarOf(cuboid, options_.color, content_.up)));
  };
  for (CuboidLayer* layer : {&planar_, &non_planar_}) {
    layer->setColors(color);
    layer->setHeightRange(options_.color == ColorBy::Height ? &range : nullptr);
  }
}

void Scene::show(const ViewOptions& options) {
  options_ = options;
  recolor();
  for (CuboidLayer* layer : {&planar_, &non_planar_}) {
    layer->actor()->SetVisibility(options.show.occupied);
    layer->setEdges(options.show.edges);
  }
  unknown_.actor()->SetVisibility(options.show.unknown);
  for (const auto& prop : trajectory_) {
    // In first person one would look out of the middle of the path.
    prop->SetVisibility(options.show.trajectory && options.camera != CameraPreset::FirstPerson);
  }
  for (const auto& prop : clouds_) prop->SetVisibility(options.show.cloud);
  if (options.background) {
    const Color c = *options.background;
    renderer_->GradientBackgroundOff();
    renderer_->SetBackground(c.red / 255.0, c.green / 255.0, c.blue / 255.0);
  } else {
    renderer_->GradientBackgroundOn();
    renderer_->SetBackground(1.0, 1.0, 1.0);
    renderer_->SetBackground2(0.875, 0.90, 0.93);
  }
  replace(grid_, makeGroundGrid(ground_, origin_, isDark(options)), options.show.ground_grid);
  captions_ = Captions();
  const double corner = cornerAxesSide(options.width, options.height);
  if (options.show.axes) captions_.take(0.0, 0.0, corner, corner);
  replace(legend_,
          options.show.legend ? makeLegend(content_, options, isDark(options), captions_) : Props(),
          options.show.legend);
}

void place(const CameraView& view, const Vector3& origin, vtkCamera* camera) {
  const Vector3 position = view.position - origin;
  const Vector3 focal_point = view.focal_point - origin;
  camera->SetPosition(position.x(), position.y(), position.z());
  camera->SetFocalPoint(focal_point.x(), focal_point.y(), focal_point.z());
  camera->SetViewUp(view.view_up.x(), view.view_up.y(), view.view_up.z());
  camera->SetParallelProjection(view.parallel);
  camera->SetParallelScale(view.parallel_scale);
  camera->SetViewAngle(view.view_angle / kRadiansPerDegree);
}

void Scene::look(const CameraView& view) {
  place(view, origin_, renderer_->GetActiveCamera());
  cameraMoved();
}

CameraView Scene::camera() const {
  vtkCamera* camera = renderer_->GetActiveCamera();
  CameraView view;
  view.position = origin_ + Vector3(camera->GetPosition());
  view.focal_point = origin_ + Vector3(camera->GetFocalPoint());
  const Vector3 up(camera->GetViewUp());
  const Vector3 direction = view.direction();
  view.view_up = (up - up.dot(direction) * direction).normalized();
  view.parallel = camera->GetParallelProjection() != 0;
  view.parallel_scale = camera->GetParallelScale();
  view.view_angle = camera->GetViewAngle() * kRadiansPerDegree;
  return view;
}

void Scene::cameraMoved() {
  const CameraView view = camera();
  planar_.setView(view, options_);
  ViewOptions only_clip = options_;
  only_clip.cutaway = Cutaway::None;
  non_planar_.setView(view, only_clip);
  unknown_.setView(view, only_clip);
  const bool dark = isDark(options_);
  replace(ruler_,
          makeRuler(ground_, origin_, view, options_.width, options_.height, dark, captions_),
          options_.show.axes && options_.camera != CameraPreset::FirstPerson);
  replace(corner_axes_, makeCornerAxes(view, options_.width, options_.height, dark),
          options_.show.axes);
  renderer_->ResetCameraClippingRange();
}

void Scene::highlight(int index) {
  Props frame;
  if (index >= 0 && static_cast<std::size_t>(index) < content_.cuboids.size())
    frame = makeOutline(content_.cuboids[static_cast<std::size_t>(index)], origin_);
  replace(highlight_, frame, true);
}

}  // namespace planar_mapping::visualization
