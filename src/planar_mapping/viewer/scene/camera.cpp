// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/scene/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/plan/plan.h"

namespace planar_mapping {

namespace {

constexpr double kIsoElevation = 35.0 * kRadiansPerDegree;
constexpr double kIsoViewAngle = 28.0 * kRadiansPerDegree;
constexpr double kEyeViewAngle = 62.0 * kRadiansPerDegree;
constexpr double kMargin = 1.08;  // of the content's extent, left around it

struct Frame {
  Vector3 right, up, back;  // of the picture, world frame; back points to the viewer
};

Frame frameOf(const Vector3& direction, const Vector3& up) {
  const Vector3 right = direction.cross(up).normalized();
  return {right, right.cross(direction), -direction};
}

// What has to be in the picture: corners of everything drawn, thinned where there is very much.
std::vector<Vector3> extremePoints(const SceneContent& content, const ViewOptions& options) {
  std::vector<Vector3> points;
  const Vector3 up = content.up.normalized();
  for (const Cuboid* cuboid : content.framed()) {
    const auto corner = corners(*cuboid);
    double lowest = INFINITY;
    for (const Vector3& p : corner) lowest = std::min(lowest, p.dot(up));
    if (options.clip_above && lowest > *options.clip_above) continue;
    points.insert(points.end(), corner.begin(), corner.end());
  }
  if (content.sensors_known) {
    for (const Pose& pose : content.trajectory) points.push_back(pose.translation());
  }
  const std::size_t step = std::max<std::size_t>(1, content.cloudPoints() / 100000);
  for (const SceneCloud& cloud : content.clouds) {
    for (std::size_t i = 0; i < cloud.size(); i += step) {
      const Vector3 p = cloud.point(i);
      if (p.allFinite()) points.push_back(p);
    }
  }
  if (points.empty() || content.cuboids.empty()) {
    for (const Cuboid& cuboid : content.unknown) {
      for (const Vector3& p : corners(cuboid)) points.push_back(p);
    }
  }
  return points;
}

// Area of planar cuboids that show the viewer the side they were seen from.
double visibleArea(const SceneContent& content, const Vector3& to_viewer) {
  double area = 0.0;
  for (const Cuboid& cuboid : content.cuboids) {
    if (cuboid.plane_id < 0) continue;
    const double facing = to_viewer.dot(cuboid.orientation * Vector3::UnitZ());
    area += cuboid.size.x() * cuboid.size.y() * std::max(0.0, facing);
  }
  return area;
}

Vector3 isoDirection(const SceneContent& content) {
  Vector3 right, forward;
  horizontalAxes(content.up, right, forward);
  const Vector3 up = content.up.normalized();
  Vector3 best = Vector3::Zero();
  double largest = -1.0;
  for (int i = 0; i < 8; ++i) {
    // 30 degrees off the axes: walls along the axes are then seen unlike each other.
    const double azimuth = (i / 2) * M_PI_2 + (i % 2 == 0 ? 30.0 : 60.0) * kRadiansPerDegree;
    const Vector3 to_viewer =
        std::cos(kIsoElevation) * (std::sin(azimuth) * right - std::cos(azimuth) * forward) +
        std::sin(kIsoElevation) * up;
    const double area = visibleArea(content, to_viewer);
    if (area > largest * (1.0 + 1e-9) + 1e-12) {
      largest = area;
      best = -to_viewer;
    }
  }
  return best.normalized();
}

Vector3 presetDirection(const SceneContent& content, CameraPreset preset) {
  Vector3 right, forward;
  horizontalAxes(content.up, right, forward);
  switch (preset) {
    case CameraPreset::Top:
      return -content.up.normalized();
    case CameraPreset::Front:
      return forward;
    case CameraPreset::Back:
      return -forward;
    case CameraPreset::Left:
      return right;
    case CameraPreset::Right:
      return -right;
    case CameraPreset::Iso:
    case CameraPreset::FirstPerson:
      break;
  }
  return isoDirection(content);
}

// The fraction of the picture's width that the scale of the legend takes at the right.
double reservedWidth(const ViewOptions& options) {
  const bool scale = options.show.legend && options.show.occupied &&
                     options.color != ColorBy::Plane && options.color != ColorBy::State;
  return scale ? 0.075 : 0.0;
}

void fitParallel(const std::vector<Vector3>& points, const Frame& frame, double aspect,
                 double reserved, CameraView& view) {
  Eigen::AlignedBox2d box;
  double nearest = -INFINITY;
  for (const Vector3& p : points) {
    box.extend(Vector2(p.dot(frame.right), p.dot(frame.up)));
    nearest = std::max(nearest, p.dot(frame.back));
  }
  const Vector2 half = 0.5 * box.sizes();
  view.parallel_scale =
      kMargin * std::max({half.y(), half.x() / (aspect * (1.0 - reserved)), 0.05});
  const double shift = reserved * aspect * view.parallel_scale;
  const Vector3 on_axis = (box.center().x() + shift) * frame.right + box.center().y() * frame.up;
  const double depth = nearest + 2.0 * view.parallel_scale;
  view.position = on_axis + depth * frame.back;
  view.focal_point = on_axis + nearest * frame.back;
}

// Each side of the picture is a plane through the eye: the tightest of each kind fix the eye.
void fitPerspective(const std::vector<Vector3>& points, const Frame& frame, double aspect,
                    double reserved, CameraView& view) {
  const double tan_up = std::tan(0.5 * view.view_angle);
  const double tan_left = tan_up * aspect;
  const double tan_right = tan_left * (1.0 - 2.0 * reserved);
  double right = -INFINITY, left = -INFINITY, top = -INFINITY, bottom = -INFINITY;
  double nearest = -INFINITY, farthest = INFINITY;
  for (const Vector3& p : points) {
    const double x = p.dot(frame.right), y = p.dot(frame.up), z = p.dot(frame.back);
    right = std::max(right, x + tan_right * z);
    left = std::max(left, -x + tan_left * z);
    top = std::max(top, y + tan_up * z);
    bottom = std::max(bottom, -y + tan_up * z);
    nearest = std::max(nearest, z);
    farthest = std::min(farthest, z);
  }
  const double depth =
      std::max((right + left) / (tan_right + tan_left), (top + bottom) / (2.0 * tan_up));
  const double eye_z = std::max(nearest + (depth - nearest) * kMargin, nearest + 0.1);
  const double eye_x = 0.5 * ((right - tan_right * eye_z) + (tan_left * eye_z - left));
  const double eye_y = 0.5 * (top - bottom);
  view.position = eye_x * frame.right + eye_y * frame.up + eye_z * frame.back;
  // In the middle of it all, so that the window turns about it.
  view.focal_point = view.position - (eye_z - 0.5 * (nearest + farthest)) * frame.back;
}

void lookAlong(const Pose& pose, bool optical, CameraView& view, Vector3& up) {
  const Matrix3 axes = pose.linear();
  const Vector3 forward = optical ? axes.col(2) : axes.col(0);
  up = optical ? Vector3(-axes.col(1)) : Vector3(axes.col(2));
  view.position = pose.translation();
  view.focal_point = view.position + forward;
}

}  // namespace

void horizontalAxes(const Vector3& up, Vector3& right, Vector3& forward) {
  const Vector3 u = up.normalized();
  // For a camera's frame (up = -y) this gives right = x and forward = z.
  const Vector3 seed = std::abs(u.x()) < 0.9 ? Vector3(1.0, 0.0, 0.0) : Vector3(0.0, 0.0, -1.0);
  right = (seed - seed.dot(u) * u).normalized();
  forward = u.cross(right);
}

double groundHeight(const SceneContent& content) {
  const Vector3 up = content.up.normalized();
  std::vector<Vector3> sensors;
  if (content.sensors_known)
    for (const Pose& pose : content.trajectory) sensors.push_back(pose.translation());
  if (!content.cuboids.empty()) return floorHeight(content.cuboids, up, sensors);
  std::vector<double> heights;
  for (const SceneCloud& cloud : content.clouds) {
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Vector3 p = cloud.point(i);
      if (p.allFinite()) heights.push_back(p.dot(up));
    }
  }
  if (heights.empty()) return floorHeight(content.unknown, up);
  // A few stray points deep below the floor must not become the ground.
  return detail::ranked(heights, heights.size() / 100);
}

CameraView placeCamera(const SceneContent& content, const ViewOptions& options) {
  options.validate();
  CameraView view;
  Vector3 up = content.up.normalized();
  if (options.camera == CameraPreset::FirstPerson) {
    if (content.trajectory.empty() && !options.camera_position)
      throw InputError("no trajectory to look along: give a camera position, or another camera");
    view.view_angle = kEyeViewAngle;
    if (!content.trajectory.empty())
      lookAlong(content.trajectory.back(), looksAlongZ(content), view, up);
    view.view_angle = 2.0 * std::atan(std::tan(0.5 * view.view_angle) / options.zoom);
  } else {
    const std::vector<Vector3> points = extremePoints(content, options);
    if (points.empty()) throw InputError("there is nothing to look at: the map is empty");
    const Vector3 direction = presetDirection(content, options.camera);
    if (options.camera == CameraPreset::Top) {
      Vector3 right;
      horizontalAxes(content.up, right, up);
    }
    if (options.view_up) up = options.view_up->normalized();
    if (direction.cross(up).norm() < 1e-6)
      throw ParameterError("view up lies along the line of sight");
    view.parallel = options.camera != CameraPreset::Iso;
    view.view_angle = kIsoViewAngle;
    const double aspect = static_cast<double>(options.width) / options.height;
    (view.parallel ? fitParallel : fitPerspective)(points, frameOf(direction, up), aspect,
                                                   reservedWidth(options), view);
    if (view.parallel) {
      view.parallel_scale /= options.zoom;
    } else {
      view.view_angle = 2.0 * std::atan(std::tan(0.5 * view.view_angle) / options.zoom);
    }
  }
  if (options.camera_position || options.focal_point) {
    if (options.camera_position && view.parallel) {
      view.parallel = false;  // a place to stand makes sense only with perspective
      view.view_angle = 2.0 * std::atan(std::tan(0.5 * kEyeViewAngle) / options.zoom);
    }
    if (options.focal_point) {
      view.focal_point = *options.focal_point;
    } else if (Vector3 low, high; content.bounds(low, high)) {
      view.focal_point = 0.5 * (low + high);
    }
    if (options.camera_position) view.position = *options.camera_position;
  }
  if (options.view_up) up = options.view_up->normalized();
  const Vector3 sight = view.focal_point - view.position;
  if (!(sight.norm() > 1e-9))
    throw ParameterError("camera position and focal point are the same point");
  Vector3 right = sight.normalized().cross(up);
  if (right.norm() < 1e-6) {
    if (options.view_up) throw ParameterError("view up lies along the line of sight");
    horizontalAxes(content.up, right, up);
    right = sight.normalized().cross(up);
  }
  view.view_up = right.normalized().cross(sight.normalized());
  return view;
}

}  // namespace planar_mapping
