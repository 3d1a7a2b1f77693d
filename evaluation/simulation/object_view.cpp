// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/simulation/object_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"

namespace planar_mapping::evaluation {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// A ray in the object's own frame: its surfaces are |x| = half.x and so on, or of that radius.
struct LocalRay {
  Vector3 origin;
  Vector3 direction;
};

bool hitBox(const LocalRay& ray, const Vector3& half, double& t, int& face) {
  double enter = -kNever;
  double leave = kNever;
  for (int axis = 0; axis < 3; ++axis) {
    const double direction = ray.direction[axis];
    if (direction == 0.0) {
      if (std::abs(ray.origin[axis]) > half[axis]) return false;
      continue;
    }
    const double inverse = 1.0 / direction;
    const double toward = direction > 0.0 ? -half[axis] : half[axis];
    const double first = (toward - ray.origin[axis]) * inverse;
    const double last = (-toward - ray.origin[axis]) * inverse;
    if (first > enter) {
      enter = first;
      face = 2 * axis + (direction > 0.0 ? 0 : 1);
    }
    leave = std::min(leave, last);
    if (enter > leave) return false;
  }
  t = enter;
  return enter > 0.0;
}

/// Smaller root of a t^2 + 2 b t + c = 0 where the ray enters a round surface.
bool enters(double a, double b, double c, double& t) {
  const double discriminant = b * b - a * c;
  if (discriminant <= 0.0 || a <= 0.0) return false;
  t = (-b - std::sqrt(discriminant)) / a;
  return t > 0.0;
}

bool hitSphere(const LocalRay& ray, double radius, double& t, int& face) {
  face = kCurvedFace;
  return enters(ray.direction.squaredNorm(), ray.origin.dot(ray.direction),
                ray.origin.squaredNorm() - radius * radius, t);
}

bool hitCylinder(const LocalRay& ray, const Vector3& half, double& t, int& face) {
  const double radius = half.x();
  double nearest = kNever;
  double side = 0.0;
  const auto o = ray.origin.head<2>();
  const auto d = ray.direction.head<2>();
  if (enters(d.squaredNorm(), o.dot(d), o.squaredNorm() - radius * radius, side) &&
      std::abs(ray.origin.z() + side * ray.direction.z()) <= half.z()) {
    nearest = side;
    face = kCurvedFace;
  }
  if (ray.direction.z() != 0.0) {
    const double end = ray.direction.z() > 0.0 ? -half.z() : half.z();
    const double cap = (end - ray.origin.z()) / ray.direction.z();
    if (cap > 0.0 && cap < nearest && (o + cap * d).squaredNorm() <= radius * radius) {
      nearest = cap;
      face = ray.direction.z() > 0.0 ? 4 : 5;
    }
  }
  t = nearest;
  return nearest < kNever;
}

bool hitShape(Shape shape, const LocalRay& ray, const Vector3& half, double& t, int& face) {
  switch (shape) {
    case Shape::Box:
      return hitBox(ray, half, t, face);
    case Shape::Cylinder:
      return hitCylinder(ray, half, t, face);
    case Shape::Sphere:
      return hitSphere(ray, half.x(), t, face);
  }
  return false;
}

struct Extent {
  double left = kNever, right = -kNever, top = kNever, bottom = -kNever;

  void add(const Vector3& p) {
    left = std::min(left, p.x() / p.z());
    right = std::max(right, p.x() / p.z());
    top = std::min(top, p.y() / p.z());
    bottom = std::max(bottom, p.y() / p.z());
  }
};

/// Image of the part of the object's bounding box that is in front of the camera: its corners, and
/// the points where its edges pass the plane of the nearest depth.
void placeInImage(const PinholeCamera& camera, const Pose& T_camera_object, ObjectView& view) {
  Vector3 corners[8];
  double nearest = kNever;
  for (int i = 0; i < 8; ++i) {
    const Vector3 sign(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    corners[i] = T_camera_object * view.half.cwiseProduct(sign);
    nearest = std::min(nearest, corners[i].z());
  }
  view.nearest = static_cast<float>(std::max(nearest, kNearestDepth) * (1.0 - 1e-6));
  Extent extent;
  for (int i = 0; i < 8; ++i) {
    const Vector3& a = corners[i];
    if (a.z() >= kNearestDepth) extent.add(a);
    for (const int bit : {1, 2, 4}) {
      const Vector3& b = corners[i ^ bit];
      if (a.z() >= kNearestDepth || b.z() < kNearestDepth) continue;
      const double fraction = (kNearestDepth - a.z()) / (b.z() - a.z());
      Vector3 p = a + fraction * (b - a);
      p.z() = kNearestDepth;
      extent.add(p);
    }
  }
  if (extent.left > extent.right) return;
  const auto pixel = [](double value, int high) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(high)));
  };
  view.window.column_begin = pixel(std::floor(camera.fx * extent.left + camera.cx), camera.width);
  view.window.column_end =
      pixel(std::ceil(camera.fx * extent.right + camera.cx) + 1.0, camera.width);
  view.window.row_begin = pixel(std::floor(camera.fy * extent.top + camera.cy), camera.height);
  view.window.row_end =
      pixel(std::ceil(camera.fy * extent.bottom + camera.cy) + 1.0, camera.height);
}

}  // namespace

bool ObjectView::hit(const Vector3& ray, double& depth, int& face) const {
  return hitShape(object->shape, {origin, R_object_camera * ray}, half, depth, face) &&
         depth >= kNearestDepth;
}

std::vector<ObjectView> viewsOf(const Scene& scene, const PinholeCamera& camera,
                                const Pose& T_world_camera, int frame) {
  std::vector<ObjectView> views;
  const Pose T_camera_world = T_world_camera.inverse();
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const SceneObject& object = scene.objects[i];
    if (!object.isThere(frame)) continue;
    ObjectView view;
    view.object = &object;
    view.scene = &scene;
    view.frame = frame;
    view.index = static_cast<int>(i);
    view.half = 0.5 * object.size;
    const Pose T_camera_object = T_camera_world * object.T_world_object;
    placeInImage(camera, T_camera_object, view);
    if (view.window.column_begin >= view.window.column_end ||
        view.window.row_begin >= view.window.row_end)
      continue;
    const Pose T_object_camera = T_camera_object.inverse();
    view.R_object_camera = T_object_camera.linear();
    view.origin = T_object_camera.translation();
    view.light = object.T_world_object.linear().transpose() * scene.light;
    views.push_back(view);
  }
  std::sort(views.begin(), views.end(), [](const ObjectView& a, const ObjectView& b) {
    return a.nearest < b.nearest || (a.nearest == b.nearest && a.index < b.index);
  });
  return views;
}

std::vector<const ObjectView*> byIndex(const std::vector<ObjectView>& views, const Scene& scene) {
  std::vector<const ObjectView*> sorted(scene.objects.size(), nullptr);
  for (const ObjectView& view : views) sorted[static_cast<std::size_t>(view.index)] = &view;
  return sorted;
}

void requireSound(const SceneObject& object) {
  if (!object.T_world_object.matrix().allFinite() || !object.size.allFinite() ||
      object.size.minCoeff() < 0.0)
    throw InputError("'" + object.name + "' has no finite place and size");
}

bool intersect(const SceneObject& object, const Vector3& origin, const Vector3& direction,
               double& t, int& face) {
  const Pose T_object_world = object.T_world_object.inverse();
  const LocalRay ray{T_object_world * origin, T_object_world.linear() * direction};
  return hitShape(object.shape, ray, 0.5 * object.size, t, face);
}

}  // namespace planar_mapping::evaluation
