// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/drawing/projection_2d.h"

#include <vtkContext2D.h>
#include <vtkImageData.h>
#include <vtkNew.h>

#include <algorithm>
#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/viewer/drawing/canvas.h"
#include "planar_mapping/viewer/scene/ground.h"

namespace planar_mapping {

namespace {

using visualization::Canvas;
using visualization::GroundFrame;

constexpr Color kOccupied = {38, 50, 72};
constexpr Color kUnknown = {178, 180, 184};
constexpr Color kGrid = {229, 232, 236};
constexpr Color kPath = {205, 38, 52};
constexpr Color kPlanInk = {40, 42, 46};

// The map's plane on the picture: x right, y up.
struct Page {
  GroundFrame frame;
  double pixels_per_metre = 1.0;
  Vector2 corner = Vector2::Zero();  // where (low_right, low_forward) is, pixels
  double top = 0.0, right = 0.0;     // end of the drawing, pixels

  Vector2 at(double along_right, double along_forward) const {
    return {corner.x() + (along_right - frame.low_right) * pixels_per_metre,
            corner.y() - (along_forward - frame.low_forward) * pixels_per_metre};
  }
  Vector2 placeOf(const Vector2& pixel) const {
    return {frame.low_right + (pixel.x() - corner.x()) / pixels_per_metre,
            frame.low_forward + (corner.y() - pixel.y()) / pixels_per_metre};
  }
  Vector2 at(const Vector3& p) const { return at(p.dot(frame.right), p.dot(frame.forward)); }
};

Page makePlan(const SceneContent& content, const ViewOptions& options, double font) {
  Page plan;
  plan.frame = visualization::groundFrame(content);
  const GroundFrame& f = plan.frame;
  const double left = 3.2 * font, below = 4.6 * font, margin = 1.2 * font;
  const double width = std::max(options.width - left - margin, 8.0);
  const double height = std::max(options.height - below - margin, 8.0);
  const double across = f.high_right - f.low_right;
  const double along = f.high_forward - f.low_forward;
  plan.pixels_per_metre = options.zoom * std::min(width / across, height / along);
  plan.corner = {left + 0.5 * (width - plan.pixels_per_metre * across),
                 options.height - below - 0.5 * (height - plan.pixels_per_metre * along)};
  plan.right = plan.corner.x() + plan.pixels_per_metre * across;
  plan.top = plan.corner.y() - plan.pixels_per_metre * along;
  return plan;
}

/// The storeys in the axes of the frame, in cells of the map or, where those are smaller, pixels.
std::vector<Plan> storeysOf(const SceneContent& content, const ViewOptions& options,
                            const RobotModel& robot, const Page& page) {
  Matrix3 axes;
  axes << page.frame.right, page.frame.forward, page.frame.up;
  PlanSource source;
  source.unseen = content.unseen;
  source.knows_sides = content.sensors_known;
  source.occupied = content.cuboids;
  source.space = content.unseen == Unseen::Unknown ? content.free : content.unknown;
  source.ground = content.ground;
  source.floors = content.floors;
  if (content.sensors_known)
    for (const Pose& pose : content.trajectory) source.path.push_back(pose.translation());
  if (content.resolution > 0.0) source.resolution = content.resolution;
  source.turn(Quaternion(axes.transpose()));
  source.up = Vector3::UnitZ();
  const double pixel = options.zoom / page.pixels_per_metre;  // where all of it is shown
  const double cell = std::max(source.resolution, pixel);
  return plansOf(std::move(source), robot, cell);
}

/// The grid as a picture: obstacles and what is unknown.
vtkSmartPointer<vtkImageData> pictureOf(const Plan& grid, const ViewOptions& options,
                                        const Page& page) {
  auto picture = vtkSmartPointer<vtkImageData>::New();
  picture->SetDimensions(options.width, options.height, 1);
  picture->AllocateScalars(VTK_UNSIGNED_CHAR, 4);
  auto* rgba = static_cast<std::uint8_t*>(picture->GetScalarPointer());
  for (int row = options.height - 1; row >= 0; --row) {
    for (int column = 0; column < options.width; ++column, rgba += 4) {
      const Vector2 pixel(column + 0.5, row + 0.5);
      const bool inside = pixel.x() > page.corner.x() && pixel.x() < page.right &&
                          pixel.y() > page.top && pixel.y() < page.corner.y();
      const Vector2 place = page.placeOf(pixel);
      std::uint32_t x = 0, y = 0;
      const int value = grid.cellOf(place.x(), place.y(), x, y) ? grid.at(x, y) : Plan::kUnknown;
      const bool is_occupied = value == Plan::kOccupied;
      const Color color = is_occupied ? kOccupied : kUnknown;
      rgba[0] = color.red;
      rgba[1] = color.green;
      rgba[2] = color.blue;
      const bool is_shown =
          is_occupied ? options.show.occupied : value != Plan::kFree && options.show.unknown;
      rgba[3] = inside && is_shown ? 255 : 0;
    }
  }
  return picture;
}

void drawPath(const SceneContent& content, const Page& plan, double font, Canvas& canvas) {
  std::vector<Vector2> path;
  for (const Pose& pose : content.trajectory) {
    const Vector2 p = plan.at(pose.translation());
    if (path.empty() || (p - path.back()).norm() > 0.5) path.push_back(p);
  }
  if (path.empty()) return;
  const double size = 0.45 * font;
  if (path.size() == 1) {
    canvas.fill({path[0] + Vector2(-size, 0), path[0] + Vector2(0, size),
                 path[0] + Vector2(size, 0), path[0] + Vector2(0, -size)},
                kPath);
    return;
  }
  canvas.line(path, 0.16 * font, kPath, true);
  // The last stretch gives the heading, not the last two poses: those may jitter.
  Vector2 heading = path.back() - path[path.size() - 2];
  for (std::size_t i = path.size(); i-- > 0;) {
    heading = path.back() - path[i];
    if (heading.norm() > 2.0 * size) break;
  }
  heading.normalize();
  const Vector2 across(-heading.y(), heading.x());
  const Vector2 tip = path.back() + 1.6 * size * heading;
  canvas.fill({tip, path.back() + 0.8 * size * across, path.back() - 0.8 * size * across}, kPath);
}

void drawGrid(const Page& plan, Canvas& canvas) {
  const GroundFrame& f = plan.frame;
  if (f.step * plan.pixels_per_metre < 4.0) return;
  for (const double v : visualization::multiples(f.low_right, f.high_right, f.step))
    canvas.line({plan.at(v, f.low_forward), plan.at(v, f.high_forward)}, 1.0, kGrid);
  for (const double v : visualization::multiples(f.low_forward, f.high_forward, f.step))
    canvas.line({plan.at(f.low_right, v), plan.at(f.high_right, v)}, 1.0, kGrid);
}

void drawRulers(const Page& plan, double font, Canvas& canvas) {
  const GroundFrame& f = plan.frame;
  const double length = std::max(f.high_right - f.low_right, f.high_forward - f.low_forward);
  const double step = std::max(f.step, visualization::roundStep(length, 12));
  visualization::Captions captions;
  for (const double v : visualization::multiples(f.low_right, f.high_right, step)) {
    const Vector2 p = plan.at(v, f.low_forward) + Vector2(0.0, 0.8 * font);
    const std::string text = visualization::shortNumber(v);
    if (captions.takeCentered(text, p.x(), canvas.flipped(p.y()), 0.75 * font))
      canvas.text(text, p, 0.75 * font, 0, kPlanInk);
  }
  for (const double v : visualization::multiples(f.low_forward, f.high_forward, step)) {
    const Vector2 p = plan.at(f.low_right, v) - Vector2(0.4 * font, 0.0);
    const std::string text = visualization::shortNumber(v);
    const double width = visualization::Captions::widthOf(text, 0.75 * font);
    if (captions.takeCentered(text, p.x() - 0.5 * width, canvas.flipped(p.y()), 0.75 * font))
      canvas.text(text, p, 0.75 * font, 1, kPlanInk);
  }
}

void drawLegend(const SceneContent& content, const ViewOptions& options, const Page& plan,
                double font, Canvas& canvas) {
  const double y = options.height - 1.3 * font;
  double x = 1.2 * font;
  const double border = options.width - font;
  const auto entry = [&](const std::string& words, Color color) {
    if (x + 1.7 * font + canvas.textSize(words, 0.9 * font).x() > border) return;
    const Vector2 at(x, y - 0.4 * font);
    std::vector<Vector2> box = {at, at + Vector2(1.3 * font, 0.0),
                                at + Vector2(1.3 * font, 0.8 * font),
                                at + Vector2(0.0, 0.8 * font)};
    canvas.fill(box, color);
    box.push_back(at);
    canvas.line(box, 1.0, kPlanInk);
    canvas.text(words, {x + 1.7 * font, y}, 0.9 * font, -1, kPlanInk);
    x += 3.0 * font + canvas.textSize(words, 0.9 * font).x();
  };
  if (options.show.occupied) entry("occupied", kOccupied);
  entry("free", {255, 255, 255});
  if (options.show.unknown) entry("unknown", kUnknown);
  const double path_end = x + 2.6 * font + canvas.textSize("path", 0.9 * font).x();
  if (options.show.trajectory && !content.trajectory.empty() && path_end < border) {
    canvas.line({{x, y}, {x + 2.2 * font, y}}, 0.16 * font, kPath, true);
    canvas.text("path", {x + 2.6 * font, y}, 0.9 * font, -1, kPlanInk);
    x = path_end + font;
  }
  // Scale bar: a round length of about an eighth of the picture.
  const double metres = visualization::roundStep(options.width / 12.0 / plan.pixels_per_metre, 1);
  const double length = metres * plan.pixels_per_metre;
  if (length > 0.6 * options.width) return;
  const Vector2 right(options.width - 1.5 * font, y + 0.45 * font);
  const Vector2 left = right - Vector2(length, 0.0);
  const double text_width =
      canvas.textSize(visualization::shortNumber(metres) + " m", 0.85 * font).x();
  if (std::min(left.x(), 0.5 * (left.x() + right.x() - text_width)) < x) return;
  canvas.line({left, right}, 0.18 * font, kPlanInk);
  for (const Vector2& end : {left, right})
    canvas.line({end - Vector2(0.0, 0.3 * font), end + Vector2(0.0, 0.3 * font)}, 0.14 * font,
                kPlanInk);
  canvas.text(visualization::shortNumber(metres) + " m",
              0.5 * (left + right) - Vector2(0.0, 0.75 * font), 0.85 * font, 0, kPlanInk);
}

}  // namespace

Image drawProjection2d(const SceneContent& content, const ViewOptions& options,
                       const RobotModel& robot, std::size_t storey) {
  content.validate();
  options.validate();
  if (content.cuboids.empty() && content.unknown.empty())
    throw InputError("there is nothing to project: the map is empty");
  const double font = std::max(10.0, 0.026 * std::min(options.width, options.height));
  const Page plan = makePlan(content, options, font);
  const std::vector<Plan> storeys = storeysOf(content, options, robot, plan);
  if (storey >= storeys.size())
    throw ParameterError("there is no storey " + std::to_string(storey) + ": the map has " +
                         std::to_string(storeys.size()));
  const vtkSmartPointer<vtkImageData> picture = pictureOf(storeys[storey], options, plan);
  return visualization::drawPage(options.width, options.height,
                                 options.background.value_or(Color{255, 255, 255}),
                                 [&](Canvas& canvas) {
                                   canvas.context().DrawImage(0.0f, 0.0f, picture);
                                   if (options.show.ground_grid) drawGrid(plan, canvas);
                                   if (options.show.trajectory)
                                     drawPath(content, plan, font, canvas);
                                   if (options.show.axes) drawRulers(plan, font, canvas);
                                   if (options.show.legend)
                                     drawLegend(content, options, plan, font, canvas);
                                 });
}

}  // namespace planar_mapping
