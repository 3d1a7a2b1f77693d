// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/scene/decorations.h"

#include <vtkActor.h>
#include <vtkBillboardTextActor3D.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkConeSource.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkTextProperty.h>
#include <vtkTubeFilter.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace planar_mapping::visualization {
namespace {

constexpr std::array<Color, 3> kAxisColors = {{{205, 52, 52}, {52, 150, 62}, {48, 88, 200}}};
constexpr Color kPathColor = {196, 30, 58};

vtkIdType insert(vtkPoints* points, const Vector3& p) {
  return points->InsertNextPoint(p.x(), p.y(), p.z());
}

void insertSegment(vtkPoints* points, vtkCellArray* lines, const Vector3& a, const Vector3& b) {
  const std::array<vtkIdType, 2> ids = {insert(points, a), insert(points, b)};
  lines->InsertNextCell(2, ids.data());
}

vtkSmartPointer<vtkActor> actorOf(vtkPolyData* data, bool lit) {
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  actor->GetProperty()->SetLighting(lit);
  actor->GetProperty()->SetAmbient(0.45);
  actor->GetProperty()->SetDiffuse(0.75);
  return actor;
}

vtkSmartPointer<vtkPolyData> linesOf(vtkPoints* points, vtkCellArray* lines) {
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetLines(lines);
  return data;
}

/// Lines as tubes.
vtkSmartPointer<vtkActor> tubesOf(vtkPolyData* lines, double radius, int sides) {
  vtkNew<vtkTubeFilter> tube;
  tube->SetInputData(lines);
  tube->SetRadius(radius);
  tube->SetNumberOfSides(sides);
  tube->CappingOn();
  tube->Update();
  return actorOf(tube->GetOutput(), true);
}

void paint(vtkActor* actor, Color color) {
  actor->GetProperty()->SetColor(color.red / 255.0, color.green / 255.0, color.blue / 255.0);
}

// "x" where the direction is the map's x axis, "-x" against it, else nothing.
std::string axisName(const Vector3& direction) {
  for (int i = 0; i < 3; ++i) {
    if (std::abs(direction[i]) < 0.999) continue;
    return std::string(direction[i] < 0.0 ? "-" : "") + "xyz"[i];
  }
  return {};
}

vtkSmartPointer<vtkProp> billboard(const std::string& text, const Vector3& at, int pixels,
                                   bool on_dark) {
  auto actor = vtkSmartPointer<vtkBillboardTextActor3D>::New();
  actor->SetInput(text.c_str());
  actor->SetPosition(at.x(), at.y(), at.z());
  vtkTextProperty* style = actor->GetTextProperty();
  style->SetFontFamilyToArial();
  style->SetFontSize(pixels);
  style->SetJustificationToCentered();
  style->SetVerticalJustificationToCentered();
  const double gray = on_dark ? 0.85 : 0.30;
  style->SetColor(gray, gray, gray);
  return actor;
}

}  // namespace

Props makeGroundGrid(const GroundFrame& frame, const Vector3& origin, bool on_dark) {
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> lines;
  // A little below the ground: cuboids that lie on it hide it.
  const Vector3 shift = -origin - 0.004 * frame.up;
  for (const double x : multiples(frame.low_right, frame.high_right, frame.step))
    insertSegment(points, lines, frame.point(x, frame.low_forward) + shift,
                  frame.point(x, frame.high_forward) + shift);
  for (const double y : multiples(frame.low_forward, frame.high_forward, frame.step))
    insertSegment(points, lines, frame.point(frame.low_right, y) + shift,
                  frame.point(frame.high_right, y) + shift);
  auto actor = actorOf(linesOf(points, lines), false);
  // Behind faces that lie exactly on a line of the grid.
  vtkMapper* mapper = actor->GetMapper();
  mapper->SetResolveCoincidentTopologyToPolygonOffset();
  mapper->SetRelativeCoincidentTopologyLineOffsetParameters(1.0, 8.0);
  const auto gray = static_cast<std::uint8_t>(on_dark ? 92 : 176);
  paint(actor, {gray, gray, static_cast<std::uint8_t>(gray + 6)});
  return {actor};
}

Props makeRuler(const GroundFrame& frame, const Vector3& origin, const CameraView& view,
                int picture_width, int picture_height, bool on_dark, Captions captions) {
  Props props;
  const Vector3 to_viewer = -view.direction();
  if (to_viewer.dot(frame.up) < 0.05) return props;  // from the side numbers would pile up
  const Vector3 right_of_picture = view.direction().cross(view.view_up);
  const Vector3 toward = to_viewer + view.view_up * -1.0;
  const bool near_low_forward = toward.dot(frame.forward) <= 0.0;
  const bool near_low_right =
      toward.dot(frame.right) <= 0.0 || std::abs(right_of_picture.dot(frame.right)) > 0.99;
  const double width = frame.high_right - frame.low_right;
  const double depth = frame.high_forward - frame.low_forward;
  const double step = std::max(frame.step, roundStep(std::max(width, depth), 8));
  const double gap = 0.035 * std::max(width, depth);
  const double side_forward = near_low_forward ? frame.low_forward - gap : frame.high_forward + gap;
  const double side_right = near_low_right ? frame.low_right - gap : frame.high_right + gap;
  const int pixels = std::max(9, static_cast<int>(std::lround(0.0165 * picture_height)));
  const auto add = [&](const std::string& text, const Vector3& at) {
    const Vector3 to = at - view.position;
    const double depth_of = to.dot(view.direction());
    if (!view.parallel && depth_of <= 0.0) return;
    const double pixels_per_metre =
        0.5 * picture_height /
        (view.parallel ? view.parallel_scale : depth_of * std::tan(0.5 * view.view_angle));
    const double x = 0.5 * picture_width + pixels_per_metre * to.dot(right_of_picture);
    const double y = 0.5 * picture_height + pixels_per_metre * to.dot(view.view_up);
    if (captions.takeCentered(text, x, y, pixels))
      props.push_back(billboard(text, at - origin, pixels, on_dark));
  };
  const auto numbers = [&](double low, double high, const std::string& name, const auto& place) {
    add(name.empty() ? "m" : name + " (m)", place(0.5 * (low + high), 2.5));
    for (const double v : multiples(low, high, step)) add(shortNumber(v), place(v, 1.0));
  };
  numbers(frame.low_right, frame.high_right, axisName(frame.right), [&](double v, double far) {
    return frame.point(v, side_forward + (near_low_forward ? -gap : gap) * (far - 1.0));
  });
  numbers(frame.low_forward, frame.high_forward, axisName(frame.forward),
          [&](double v, double far) {
            return frame.point(side_right + (near_low_right ? -gap : gap) * (far - 1.0), v);
          });
  return props;
}

double cornerAxesSide(int picture_width, int picture_height) {
  return 0.055 * 3.5 * std::min(picture_width, picture_height);
}

Props makeCornerAxes(const CameraView& view, int picture_width, int picture_height, bool on_dark) {
  const Vector3 right = view.direction().cross(view.view_up).normalized();
  const double size = 0.055 * std::min(picture_width, picture_height);
  const double cx = 1.9 * size;
  const double cy = 1.9 * size;
  std::array<int, 3> order = {0, 1, 2};
  // What points away from the viewer is drawn first.
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return view.direction()[a] > view.direction()[b]; });
  Props props;
  Captions letters;
  for (const int axis : order) {
    const Vector2 tip(size * right[axis], size * view.view_up[axis]);
    const double length = tip.norm();
    if (length > 0.08 * size) {
      const Vector2 along = tip / length;
      const Vector2 across(-along.y(), along.x());
      const double half = std::max(1.0, 0.035 * size);
      const Vector2 neck = tip - std::min(0.28 * size, length) * along;
      const std::array<Vector2, 7> outline = {
          half * across, neck + half * across,       neck + 3.0 * half * across,
          tip,           neck - 3.0 * half * across, neck - half * across,
          -half * across};
      props.push_back(makePolygon({outline.begin(), outline.end()}, {cx, cy}, kAxisColors[axis]));
    }
    const Vector2 at = length > 1e-9 ? Vector2(tip * (1.0 + 0.32 * size / length)) : tip;
    const std::string letter(1, "xyz"[axis]);
    const double pixels = std::max(8.0, 0.36 * size);  // no font is smaller
    if (length > 0.3 * size && letters.takeCentered(letter, cx + at.x(), cy + at.y(), pixels))
      props.push_back(
          makeText(letter, cx + at.x(), cy + at.y(), 0.36 * size, on_dark, false, true));
  }
  return props;
}

Props makeTrajectory(const SceneContent& content, const Vector3& origin) {
  Props props;
  const std::vector<Pose>& poses = content.trajectory;
  if (poses.empty()) return props;
  Vector3 low, high;
  const double extent = content.bounds(low, high) ? (high - low).norm() : 1.0;
  const double radius = std::clamp(0.0022 * extent, 0.004, 0.06);

  double length = 0.0;
  vtkNew<vtkPoints> path;
  vtkNew<vtkCellArray> path_line;
  path_line->InsertNextCell(0);
  vtkIdType count = 0;
  Vector3 last = Vector3::Constant(INFINITY);
  Vector3 heading = Vector3::Zero();
  for (const Pose& pose : poses) {
    const Vector3 p = pose.translation() - origin;
    // Tubes need distinct points.
    if (count > 0 && (p - last).norm() < 0.2 * radius) continue;
    if (count > 0) {
      heading = p - last;
      length += heading.norm();
    }
    path_line->InsertCellPoint(insert(path, p));
    last = p;
    ++count;
  }
  path_line->UpdateCellCount(static_cast<int>(count));
  if (count > 1) {
    props.push_back(tubesOf(linesOf(path, path_line), radius, 8));
    vtkNew<vtkConeSource> cone;
    const Vector3 tip = last + 3.0 * radius * heading.normalized();
    cone->SetCenter(tip.x(), tip.y(), tip.z());
    cone->SetDirection(heading.x(), heading.y(), heading.z());
    cone->SetHeight(9.0 * radius);
    cone->SetRadius(3.2 * radius);
    cone->SetResolution(20);
    cone->Update();
    props.push_back(actorOf(cone->GetOutput(), true));
    for (const auto& prop : props) paint(vtkActor::SafeDownCast(prop), kPathColor);
  }

  // Axes of at most 25 poses, spread over the path.
  const std::size_t shown = std::min<std::size_t>(poses.size(), 25);
  const double axis_length = std::clamp(0.02 * extent, 0.03, 0.4);
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> lines;
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetNumberOfComponents(3);
  for (std::size_t k = 0; k < shown; ++k) {
    const std::size_t i = shown == 1 ? 0 : k * (poses.size() - 1) / (shown - 1);
    const Vector3 at = poses[i].translation() - origin;
    for (int axis = 0; axis < 3; ++axis) {
      insertSegment(points, lines, at, at + axis_length * poses[i].linear().col(axis));
      const Color c = kAxisColors[axis];
      colors->InsertNextTuple3(c.red, c.green, c.blue);
    }
  }
  const vtkSmartPointer<vtkPolyData> data = linesOf(points, lines);
  data->GetCellData()->SetScalars(colors);
  props.push_back(tubesOf(data, std::min(0.8 * radius, 0.06 * axis_length), 6));
  return props;
}

Props makeCloud(const SceneCloud& cloud, const Vector3& origin, double point_size) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  vtkNew<vtkCellArray> vertices;
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetNumberOfComponents(3);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vector3 p = cloud.point(i);
    if (!p.allFinite()) continue;
    const vtkIdType id = insert(points, p - origin);
    vertices->InsertNextCell(1, &id);
    if (!cloud.rgb.empty()) colors->InsertNextTypedTuple(cloud.rgb.data() + 3 * i);
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetVerts(vertices);
  if (!cloud.rgb.empty()) data->GetPointData()->SetScalars(colors);
  auto actor = actorOf(data, false);
  paint(actor, {58, 62, 74});
  actor->GetProperty()->SetPointSize(static_cast<float>(point_size));
  return {actor};
}

Props makeOutline(const Cuboid& cuboid, const Vector3& origin) {
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> lines;
  const auto corner = corners(cuboid);
  for (unsigned a = 0; a < 8; ++a) {
    for (const unsigned bit : {1u, 2u, 4u}) {
      if ((a & bit) == 0)
        insertSegment(points, lines, corner[a] - origin, corner[a | bit] - origin);
    }
  }
  auto actor = actorOf(linesOf(points, lines), false);
  paint(actor, {230, 20, 120});
  actor->GetProperty()->SetLineWidth(4.0f);
  return {actor};
}

}  // namespace planar_mapping::visualization
