// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/drawing/canvas.h"

#include <vtkBrush.h>
#include <vtkContext2D.h>
#include <vtkContextActor.h>
#include <vtkContextItem.h>
#include <vtkContextScene.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPen.h>
#include <vtkRenderer.h>
#include <vtkStdString.h>
#include <vtkTextProperty.h>
#include <vtkTextRenderer.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "planar_mapping/viewer/window/render_backend.h"

namespace planar_mapping::visualization {

namespace {

class PaintedItem : public vtkContextItem {
 public:
  static PaintedItem* New();
  bool Paint(vtkContext2D* context) override {
    Canvas canvas(*context, height);
    paint(canvas);
    return true;
  }
  std::function<void(Canvas&)> paint;
  int height = 0;
};
vtkStandardNewMacro(PaintedItem);

}  // namespace

std::vector<float> Canvas::flipped(const std::vector<Vector2>& path) const {
  std::vector<float> points;
  for (const Vector2& p : path) {
    points.push_back(static_cast<float>(p.x()));
    points.push_back(static_cast<float>(flipped(p.y())));
  }
  return points;
}

void Canvas::setPen(int line_type, double width, Color color) {
  context_.GetPen()->SetLineType(line_type);
  context_.GetPen()->SetColor(color.red, color.green, color.blue);
  context_.GetPen()->SetWidth(static_cast<float>(width));
}

void Canvas::fill(const std::vector<Vector2>& convex, Color color) {
  std::vector<float> points = flipped(convex);
  context_.GetPen()->SetLineType(vtkPen::NO_PEN);
  context_.GetBrush()->SetColor(color.red, color.green, color.blue);
  context_.DrawPolygon(points.data(), static_cast<int>(convex.size()));
}

void Canvas::line(const std::vector<Vector2>& path, double width, Color color, bool dashed) {
  std::vector<float> points = flipped(path);
  setPen(dashed ? vtkPen::DASH_LINE : vtkPen::SOLID_LINE, width, color);
  context_.DrawPoly(points.data(), static_cast<int>(path.size()));
}

Vector2 Canvas::textSize(const std::string& words, double pixels) {
  vtkTextProperty* style = context_.GetTextProp();
  style->SetFontFamilyToArial();
  style->SetFontSize(std::max(6, static_cast<int>(std::lround(pixels))));
  style->SetJustificationToLeft();
  style->SetVerticalJustificationToBottom();
  std::array<float, 4> bounds{};
  context_.ComputeStringBounds(vtkStdString(words), bounds.data());
  return {bounds[2], bounds[3]};
}

void Canvas::text(const std::string& words, const Vector2& at, double pixels, int align,
                  Color color) {
  textSize(words, pixels);  // sets the style
  vtkTextProperty* style = context_.GetTextProp();
  style->SetColor(color.red / 255.0, color.green / 255.0, color.blue / 255.0);
  // Not DrawString(): VTK 9.1 repeats the upper half of some strings below them.
  vtkTextRenderer* renderer = vtkTextRenderer::GetInstance();
  if (renderer == nullptr) return;
  constexpr int kDotsPerInch = 72;
  vtkNew<vtkImageData> image;
  std::array<int, 2> size{};
  renderer->SetScaleToPowerOfTwo(false);
  if (!renderer->RenderString(style, vtkStdString(words), image, size.data(), kDotsPerInch)) return;
  context_.DrawImage(static_cast<float>(std::round(at.x() - 0.5 * (align + 1) * size[0])),
                     static_cast<float>(std::round(flipped(at.y()) - 0.5 * size[1])), image);
}

Image drawPage(int width, int height, Color background, const std::function<void(Canvas&)>& paint) {
  vtkNew<vtkRenderer> renderer;
  renderer->SetBackground(background.red / 255.0, background.green / 255.0,
                          background.blue / 255.0);
  vtkNew<vtkContextScene> scene;
  scene->SetRenderer(renderer);
  vtkNew<PaintedItem> painted;
  painted->paint = paint;
  painted->height = height;
  scene->AddItem(painted);
  vtkNew<vtkContextActor> actor;
  actor->SetScene(scene);
  renderer->AddActor(actor);
  return renderOffscreen(width, height, {renderer});
}

}  // namespace planar_mapping::visualization
