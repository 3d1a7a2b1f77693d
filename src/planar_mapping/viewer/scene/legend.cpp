// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/scene/decorations.h"

#include <vtkActor2D.h>
#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper2D.h>
#include <vtkProperty2D.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "planar_mapping/geometry/angles.h"

namespace planar_mapping::visualization {
namespace {

std::string grouped(std::size_t value) {
  std::string text = std::to_string(value);
  for (auto i = static_cast<int>(text.size()) - 3; i > 0; i -= 3)
    text.insert(static_cast<std::size_t>(i), ",");
  return text;
}

std::size_t planeCount(const SceneContent& content) {
  if (content.planes > 0) return content.planes;
  std::set<std::int32_t> ids;
  for (const Cuboid& cuboid : content.cuboids)
    if (cuboid.plane_id >= 0) ids.insert(cuboid.plane_id);
  return ids.size();
}

struct Entry {
  std::string text;
  std::vector<Color> swatches;
};

std::vector<Entry> categories(const SceneContent& content, const ViewOptions& options) {
  std::vector<Entry> entries;
  const bool loose = std::any_of(content.cuboids.begin(), content.cuboids.end(),
                                 [](const Cuboid& c) { return c.plane_id < 0; });
  if (options.show.occupied && options.color == ColorBy::Plane) {
    std::set<std::int32_t> ids;
    for (const Cuboid& cuboid : content.cuboids)
      if (cuboid.plane_id >= 0 && ids.size() < 4) ids.insert(cuboid.plane_id);
    Entry planes{"planes, by colour", {}};
    for (const std::int32_t id : ids) planes.swatches.push_back(planeColor(id));
    if (!ids.empty()) entries.push_back(planes);
    if (loose) entries.push_back({"non-planar", {planeColor(-1)}});
  } else if (options.show.occupied && options.color == ColorBy::State) {
    entries.push_back({"occupied", {stateColor(CellState::Occupied)}});
  }
  if (options.show.unknown && !content.unknown.empty())
    entries.push_back({"unknown", {stateColor(CellState::Unknown)}});
  return entries;
}

/// Empty for colours that are no scale.
std::string scaleTitle(ColorBy color) {
  return color == ColorBy::Height        ? "height (m)"
         : color == ColorBy::Probability ? "probability"
         : color == ColorBy::Tilt        ? "tilt (deg)"
                                         : "";
}

void addScale(const SceneContent& content, const ViewOptions& options, double font, bool on_dark,
              Captions& captions, Props& props) {
  const ScalarRange range = scalarRange(content, options.color);
  const double width = 1.0 * font;
  const double height = 0.42 * options.height;
  const double left = options.width - 4.6 * font;
  const double bottom = 0.5 * (options.height - height);
  // With its numbers, down to the border: another number between them would seem to be one of them.
  if (!captions.take(left - 0.6 * font, bottom - 0.5 * font, 5.2 * font, height + 2.5 * font))
    return;
  Captions numbers;
  constexpr int kBands = 96;
  for (int i = 0; i < kBands; ++i) {
    const double low = std::round(bottom + i * height / kBands);
    const double high = std::round(bottom + (i + 1) * height / kBands);
    props.push_back(makeRectangle(left, low, width, high - low,
                                  scaleColor(options.color, (i + 0.5) / kBands), 1.0));
  }
  props.push_back(makeText(scaleTitle(options.color), left - 0.6 * font,
                           bottom + height + 0.6 * font, font, on_dark));
  const double span = range.high - range.low;
  const double step = roundStep(span, 6);
  for (const double v : multiples(range.low, range.high, step)) {
    const double y = bottom + height * range.normalized(v);
    if (!numbers.takeText(shortNumber(v), left, y - 0.36 * font, 0.9 * font)) continue;
    props.push_back(makeRectangle(left + width, y - 0.5, 0.3 * font, 1.0,
                                  on_dark ? Color{220, 220, 220} : Color{60, 60, 60}, 1.0));
    props.push_back(
        makeText(shortNumber(v), left + width + 0.5 * font, y - 0.36 * font, 0.9 * font, on_dark));
  }
}

}  // namespace

double scalarOf(const Cuboid& cuboid, ColorBy color, const Vector3& up) {
  return color == ColorBy::Height        ? heightOf(cuboid, up)
         : color == ColorBy::Probability ? static_cast<double>(cuboid.probability)
         : color == ColorBy::Tilt        ? tiltOf(cuboid, up) / kRadiansPerDegree
                                         : 0.0;
}

ScalarRange scalarRange(const SceneContent& content, ColorBy color) {
  if (color == ColorBy::Tilt) return {0.0, 90.0};
  if (color != ColorBy::Height) return {0.0, 1.0};
  // From the lowest to the highest corner.
  const Vector3 up = content.up.normalized();
  double low = INFINITY;
  double high = -INFINITY;
  for (const Cuboid& cuboid : content.cuboids) {
    const double half = halfAlong(cuboid, up);
    low = std::min(low, cuboid.center.dot(up) - half);
    high = std::max(high, cuboid.center.dot(up) + half);
  }
  if (!(high > low)) return {0.0, 1.0};
  return {low, high};
}

vtkSmartPointer<vtkProp> makeText(const std::string& text, double x, double y, double pixels,
                                  bool on_dark, bool monospaced, bool centered) {
  auto actor = vtkSmartPointer<vtkTextActor>::New();
  actor->SetInput(text.c_str());
  actor->SetDisplayPosition(static_cast<int>(std::lround(x)), static_cast<int>(std::lround(y)));
  vtkTextProperty* style = actor->GetTextProperty();
  style->SetFontFamily(monospaced ? VTK_COURIER : VTK_ARIAL);
  style->SetFontSize(std::max(8, static_cast<int>(std::lround(pixels))));
  if (centered) {
    style->SetJustificationToCentered();
    style->SetVerticalJustificationToCentered();
  }
  const double gray = on_dark ? 0.92 : 0.16;
  style->SetColor(gray, gray, gray);
  return actor;
}

vtkSmartPointer<vtkProp> makePolygon(const std::vector<Vector2>& outline, const Vector2& at,
                                     Color color, double opacity) {
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> polygons;
  polygons->InsertNextCell(static_cast<vtkIdType>(outline.size()));
  for (const Vector2& p : outline)
    polygons->InsertCellPoint(points->InsertNextPoint(p.x() + at.x(), p.y() + at.y(), 0.0));
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetPolys(polygons);
  vtkNew<vtkPolyDataMapper2D> mapper;
  mapper->SetInputData(data);
  auto actor = vtkSmartPointer<vtkActor2D>::New();
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(color.red / 255.0, color.green / 255.0, color.blue / 255.0);
  actor->GetProperty()->SetOpacity(opacity);
  return actor;
}

vtkSmartPointer<vtkProp> makeRectangle(double x, double y, double width, double height, Color color,
                                       double opacity) {
  return makePolygon({{0.0, 0.0}, {width, 0.0}, {width, height}, {0.0, height}}, {x, y}, color,
                     opacity);
}

Props makeLegend(const SceneContent& content, const ViewOptions& options, bool on_dark,
                 Captions& captions) {
  Props props;
  const double font = std::max(11.0, 0.021 * std::min(options.height, options.width));
  double y = options.height - 2.2 * font;
  for (const Entry& entry : categories(content, options)) {
    const double left = options.width - 11.5 * font;
    if (!captions.take(left, y - 0.3 * font, 11.0 * font, 1.3 * font)) break;
    const double each =
        2.0 * font / static_cast<double>(std::max<std::size_t>(entry.swatches.size(), 1));
    for (std::size_t i = 0; i < entry.swatches.size(); ++i)
      props.push_back(makeRectangle(left + static_cast<double>(i) * each, y - 0.1 * font, each,
                                    font, entry.swatches[i], 1.0));
    props.push_back(makeText(entry.text, left + 2.6 * font, y, font, on_dark));
    y -= 1.6 * font;
  }
  if (options.show.occupied && !scaleTitle(options.color).empty())
    addScale(content, options, font, on_dark, captions, props);
  std::vector<std::string> facts = {grouped(content.cuboids.size()) + " cuboids"};
  if (const std::size_t planes = planeCount(content); planes > 0)
    facts.push_back(grouped(planes) + (planes == 1 ? " plane" : " planes"));
  if (content.resolution > 0.0) facts.push_back("cell " + shortNumber(content.resolution) + " m");
  if (options.show.ground_grid)
    facts.push_back("grid " + shortNumber(groundFrame(content).step) + " m");
  const double right = options.width - font;
  const auto addLine = [&](const std::string& text, double y_of_line, double pixels) {
    const double left = right - Captions::widthOf(text, pixels);
    if (left < 0.0 || !captions.takeText(text, left, y_of_line, pixels)) return false;
    props.push_back(makeText(text, right, y_of_line, pixels, on_dark));
    vtkTextActor::SafeDownCast(props.back())->GetTextProperty()->SetJustificationToRight();
    return true;
  };
  // What does not fit is left out from the end.
  for (; !facts.empty(); facts.pop_back()) {
    std::string line;
    for (const std::string& fact : facts) line += (line.empty() ? "" : "   ") + fact;
    if (addLine(line, 0.8 * font, font)) break;
  }
  if (options.show.occupied && options.cutaway != Cutaway::None && planeCount(content) > 0)
    addLine(options.cutaway == Cutaway::Seen ? "planes seen from behind are left out"
                                             : "planes that face down are left out",
            2.2 * font, 0.85 * font);
  return props;
}

}  // namespace planar_mapping::visualization
