// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/visualization/artefacts.h"

#include <vtkCamera.h>
#include <vtkNew.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>

#include <memory>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/visualization/scene_content.h"
#include "scene/cuboid_layer.h"
#include "scene/scene.h"
#include "window/render_backend.h"

namespace planar_mapping {
namespace {

using visualization::CuboidLayer;

constexpr Color kWrong = {225, 20, 20};
constexpr int kTitleHeight = 44;    // pixels above each panel
constexpr double kPaleness = 0.45;  // fraction of white in what is right, so that red stands out

Color pale(Color color) {
  const auto mix = [](std::uint8_t channel) {
    return static_cast<std::uint8_t>(channel + kPaleness * (255 - channel));
  };
  return {mix(color.red), mix(color.green), mix(color.blue)};
}

SceneContent contentOf(const std::vector<ArtefactPanel>& panels) {
  SceneContent content;
  for (const ArtefactPanel& panel : panels) {
    for (const auto* cuboids : {&panel.right, &panel.wrong}) {
      content.cuboids.insert(content.cuboids.end(), cuboids->begin(), cuboids->end());
    }
  }
  return content;
}

vtkSmartPointer<vtkTextActor> titleOf(const std::string& text, int width) {
  auto actor = vtkSmartPointer<vtkTextActor>::New();
  actor->SetInput(text.c_str());
  vtkTextProperty* style = actor->GetTextProperty();
  style->SetFontSize(22);
  style->SetColor(0.1, 0.1, 0.1);
  style->SetJustificationToCentered();
  style->SetVerticalJustificationToCentered();
  actor->SetPosition(0.5 * width, 0.5 * kTitleHeight);
  return actor;
}

/// The map of one method and the strip with its name.
struct Panel {
  std::unique_ptr<CuboidLayer> right;
  std::unique_ptr<CuboidLayer> wrong;
  vtkNew<vtkRenderer> picture;
  vtkNew<vtkRenderer> title;
};

}  // namespace

Image renderArtefacts(const std::vector<ArtefactPanel>& panels, const CameraView& view, int width,
                      int height) {
  requireInRange("width of a panel", width, 160, 4096, "px");
  requireInRange("height of a panel", height, 160, 4096, "px");
  const SceneContent content = contentOf(panels);
  content.validate();
  Vector3 low;
  Vector3 high;
  if (panels.empty() || !content.bounds(low, high)) {
    throw InputError("there are no cuboids to draw artefacts of");
  }
  const Vector3 origin = 0.5 * (low + high);
  const ScalarRange heights = {low.z(), high.z()};
  const double split = static_cast<double>(height) / (height + kTitleHeight);
  std::vector<std::unique_ptr<Panel>> drawn;
  std::vector<vtkRenderer*> renderers;
  ViewOptions options;
  options.cutaway = Cutaway::None;
  for (std::size_t i = 0; i < panels.size(); ++i) {
    auto panel = std::make_unique<Panel>();
    const double left = static_cast<double>(i) / panels.size();
    const double right = static_cast<double>(i + 1) / panels.size();
    panel->right = std::make_unique<CuboidLayer>(panels[i].right, origin, Vector3::UnitZ());
    panel->right->setColors([&heights](const Cuboid& cuboid) {
      return pale(scaleColor(ColorBy::Height, heights.normalized(cuboid.center.z())));
    });
    panel->wrong = std::make_unique<CuboidLayer>(panels[i].wrong, origin, Vector3::UnitZ());
    panel->wrong->setColors([](const Cuboid&) { return kWrong; });
    for (CuboidLayer* layer : {panel->right.get(), panel->wrong.get()}) {
      layer->setView(view, options);
      if (layer->size() > 0) panel->picture->AddActor(layer->actor());
    }
    panel->picture->SetViewport(left, 0.0, right, split);
    panel->picture->SetBackground(0.97, 0.975, 0.98);
    panel->title->SetViewport(left, split, right, 1.0);
    panel->title->SetBackground(1.0, 1.0, 1.0);
    panel->title->AddActor2D(titleOf(panels[i].title, width));
    renderers.push_back(panel->picture);
    renderers.push_back(panel->title);
    visualization::place(view, origin, panel->picture->GetActiveCamera());
    panel->picture->ResetCameraClippingRange();
    drawn.push_back(std::move(panel));
  }
  Image image = visualization::renderOffscreen(static_cast<int>(panels.size()) * width,
                                               height + kTitleHeight, renderers);
  visualization::requireDrawn(image);
  return image;
}

}  // namespace planar_mapping
