// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <vtkBillboardTextActor3D.h>
#include <vtkCoordinate.h>
#include <vtkPropCollection.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkTextRenderer.h>

#include <string>
#include <vector>

#include "planar_mapping/visualization/camera.h"
#include "scene/scene.h"

namespace planar_mapping {
namespace {

struct Text {
  std::string words;
  double left, right, bottom, top;
};

/// Where the texts of the scene are, as VTK's fonts measure them.
std::vector<Text> textsOf(vtkRenderer* renderer, int width, int height, const CameraView& view) {
  constexpr int kDotsPerInch = 72;
  std::vector<Text> texts;
  vtkPropCollection* props = renderer->GetViewProps();
  props->InitTraversal();
  while (vtkProp* prop = props->GetNextProp()) {
    std::string words;
    vtkTextProperty* style = nullptr;
    double x = 0.0;
    double y = 0.0;
    if (auto* flat = vtkTextActor::SafeDownCast(prop)) {
      words = flat->GetInput();
      style = flat->GetTextProperty();
      x = flat->GetPosition()[0];
      y = flat->GetPosition()[1];
    } else if (auto* standing = vtkBillboardTextActor3D::SafeDownCast(prop)) {
      words = standing->GetInput();
      style = standing->GetTextProperty();
      const Vector3 at(standing->GetPosition());
      // The scene's origin is the middle of its content, here the world's.
      const Vector3 to = at - view.position;
      const double scale =
          0.5 * height /
          (view.parallel ? view.parallel_scale
                         : to.dot(view.direction()) * std::tan(0.5 * view.view_angle));
      x = 0.5 * width + scale * to.dot(view.direction().cross(view.view_up));
      y = 0.5 * height + scale * to.dot(view.view_up);
    } else {
      continue;
    }
    int box[4] = {0, 0, 0, 0};
    vtkTextRenderer::GetInstance()->GetBoundingBox(style, words, box, kDotsPerInch);
    texts.push_back({words, x + box[0], x + box[1], y + box[2], y + box[3]});
  }
  return texts;
}

/// A room around the origin: planes of many heights, and unknown space.
SceneContent room() {
  SceneContent content;
  for (int i = -4; i <= 4; ++i) {
    Cuboid cuboid;
    cuboid.center = Vector3(2.0 * i, 0.7 * i, 0.2 * i);
    cuboid.size = Vector3(1.5, 3.0, 0.1);
    cuboid.plane_id = i == 0 ? -1 : i + 5;
    content.cuboids.push_back(cuboid);
  }
  content.unknown.push_back(content.cuboids.front());
  content.resolution = 0.05;
  content.trajectory.push_back(Pose::Identity());
  return content;
}

TEST(Captions, NeverMeetInAnyPicture) {
  const SceneContent content = room();
  const int sizes[][2] = {{1280, 720}, {640, 480}, {320, 240}, {200, 400}, {160, 120}, {64, 64}};
  std::size_t shown = 0;
  for (const auto& size : sizes) {
    for (const CameraPreset camera : {CameraPreset::Iso, CameraPreset::Top, CameraPreset::Front}) {
      for (const ColorBy color : {ColorBy::Plane, ColorBy::Height, ColorBy::Probability}) {
        ViewOptions options;
        options.width = size[0];
        options.height = size[1];
        options.camera = camera;
        options.color = color;
        options.show.unknown = true;
        visualization::Scene scene(content);
        scene.show(options);
        scene.look(placeCamera(content, options));
        const std::vector<Text> texts = textsOf(scene.renderer(), size[0], size[1], scene.camera());
        shown += texts.size();
        for (std::size_t i = 0; i < texts.size(); ++i) {
          for (std::size_t k = 0; k < i; ++k) {
            const Text& a = texts[i];
            const Text& b = texts[k];
            const bool meet =
                a.left < b.right && b.left < a.right && a.bottom < b.top && b.bottom < a.top;
            EXPECT_FALSE(meet) << "'" << a.words << "' meets '" << b.words << "' at " << size[0]
                               << "x" << size[1];
          }
        }
      }
    }
  }
  EXPECT_GT(shown, 300u);  // large pictures keep theirs
}

}  // namespace
}  // namespace planar_mapping
