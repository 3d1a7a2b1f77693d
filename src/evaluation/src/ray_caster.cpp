// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/ray_caster.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "planar_mapping/core/error.h"
#include "surface_pattern.h"

namespace planar_mapping {
namespace evaluation {
namespace {

constexpr double kNearest = 0.05;  ///< metres; nothing is seen closer to the camera
constexpr double kNever = std::numeric_limits<double>::infinity();

/// The object's own frame: its surfaces are |x| = half.x and so on, or of that radius.
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

bool hit(Shape shape, const LocalRay& ray, const Vector3& half, double& t, int& face) {
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

struct PixelWindow {
  int column_begin, column_end, row_begin, row_end;
};

/// Where in the image the object's bounding box can appear.
PixelWindow windowOf(const SceneObject& object, const PinholeCamera& camera,
                     const Pose& T_camera_object) {
  const PixelWindow all{0, camera.width, 0, camera.height};
  double left = kNever, right = -kNever, top = kNever, bottom = -kNever;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3 local = 0.5 * object.size.cwiseProduct(Vector3(
                                    corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1));
    const Vector3 p = T_camera_object * local;
    if (p.z() < kNearest) return all;
    const double column = camera.fx * p.x() / p.z() + camera.cx;
    const double row = camera.fy * p.y() / p.z() + camera.cy;
    left = std::min(left, column);
    right = std::max(right, column);
    top = std::min(top, row);
    bottom = std::max(bottom, row);
  }
  const auto clamped = [](double value, int high) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(high)));
  };
  return {clamped(std::floor(left), camera.width), clamped(std::ceil(right) + 1.0, camera.width),
          clamped(std::floor(top), camera.height), clamped(std::ceil(bottom) + 1.0, camera.height)};
}

bool isBehind(const SceneObject& object, const Pose& T_camera_object) {
  return T_camera_object.translation().z() + 0.5 * object.size.norm() < kNearest;
}

void drawObject(const SceneObject& object, int index, const Pose& T_world_camera,
                Rendering& image) {
  const PinholeCamera& camera = image.camera;
  const Pose T_camera_object = T_world_camera.inverse() * object.T_world_object;
  if (isBehind(object, T_camera_object)) return;
  const Pose T_object_camera = T_camera_object.inverse();
  const PixelWindow window = windowOf(object, camera, T_camera_object);
  const Vector3 half = 0.5 * object.size;
  // The ray of a pixel has z = 1 in the camera frame, so that t is the depth.
  const Vector3 step = T_object_camera.linear().col(0) / camera.fx;
  LocalRay ray{T_object_camera.translation(), Vector3::Zero()};
  for (int row = window.row_begin; row < window.row_end; ++row) {
    const Vector3 start = T_object_camera.linear() *
                          Vector3(-camera.cx / camera.fx, (row - camera.cy) / camera.fy, 1.0);
    const std::size_t first =
        static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width);
    for (int column = window.column_begin; column < window.column_end; ++column) {
      ray.direction = start + column * step;
      double t = 0.0;
      int face = 0;
      if (!hit(object.shape, ray, half, t, face) || t < kNearest) continue;
      const std::size_t i = first + static_cast<std::size_t>(column);
      if (image.object[i] >= 0 && t >= image.depth[i]) continue;
      image.depth[i] = static_cast<float>(t);
      image.object[i] = index;
      image.face[i] = static_cast<std::uint8_t>(face);
    }
  }
}

/// Normal and surface coordinates (metres) of a point of the surface, object frame.
void surfaceAt(const SceneObject& object, int face, const Vector3& local, Vector3& normal,
               double& u, double& v) {
  if (face < kCurvedFace) {
    const int axis = face / 2;
    normal = Vector3::Zero();
    normal[axis] = face % 2 == 0 ? -1.0 : 1.0;
    u = axis == 0 ? local.y() : local.x();
    v = axis == 2 ? local.y() : local.z();
    // Wood is cut along its longer side.
    const double width = axis == 0 ? object.size.y() : object.size.x();
    const double height = axis == 2 ? object.size.y() : object.size.z();
    if (object.material.pattern == Pattern::Planks && height > width) std::swap(u, v);
    return;
  }
  normal = local;
  if (object.shape == Shape::Cylinder) normal.z() = 0.0;
  normal.normalize();
  u = 0.5 * object.size.x() * std::atan2(local.y(), local.x());
  v = local.z();
}

std::uint32_t shaded(std::uint32_t color, double brightness) {
  std::uint32_t result = 0;
  for (const unsigned shift : {16u, 8u, 0u}) {
    const double channel = static_cast<double>(color >> shift & 0xFFu) * brightness;
    result |= static_cast<std::uint32_t>(std::clamp(channel, 0.0, 255.0)) << shift;
  }
  return result;
}

/// Colour, incidence and texture of one pixel from its depth and object.
void shadePixel(const Scene& scene, const Pose& T_world_camera, std::size_t i, const Vector3& ray,
                Rendering& image) {
  const auto index = static_cast<std::size_t>(image.object[i]);
  const SceneObject& object = scene.objects[index];
  const Vector3 world = T_world_camera * (static_cast<double>(image.depth[i]) * ray);
  const Vector3 local = object.T_world_object.inverse() * world;
  Vector3 normal;
  double u = 0.0;
  double v = 0.0;
  surfaceAt(object, image.face[i], local, normal, u, v);
  const Vector3 world_normal = object.T_world_object.linear() * normal;
  const Vector3 view = (T_world_camera.linear() * ray).normalized();
  const double incidence = std::clamp(-world_normal.dot(view), 0.0, 1.0);
  image.incidence[i] = static_cast<float>(incidence);

  const auto seed = static_cast<std::uint32_t>(index * 64 + image.face[i]);
  const Material& material = object.material;
  // Plain surfaces have stretches with more and with less to match.
  const double stretch = valueNoise(u / 0.35, v / 0.35, seed + 17);
  image.texture[i] = static_cast<float>(
      std::clamp(material.texture + (1.0 - material.texture) * (2.0 * stretch - 1.0), 0.0, 1.0));
  static const Vector3 kLight = Vector3(0.35, -0.5, 0.8).normalized();
  const double light = 0.58 + 0.3 * std::max(0.0, world_normal.dot(kLight)) + 0.25 * incidence;
  image.colors[i] = shaded(material.color, light * patternBrightness(material.pattern, u, v, seed));
}

}  // namespace

Rendering render(const Scene& scene, const PinholeCamera& camera, const Pose& T_world_camera) {
  requireInRange("width", camera.width, 1, 65535, "px");
  requireInRange("height", camera.height, 1, 65535, "px");
  requirePositive("fx", camera.fx, "px");
  requirePositive("fy", camera.fy, "px");
  Rendering image;
  image.camera = camera;
  const std::size_t pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  image.depth.assign(pixels, 0.0f);
  image.object.assign(pixels, -1);
  image.face.assign(pixels, 0);
  image.incidence.assign(pixels, 0.0f);
  image.texture.assign(pixels, 0.0f);
  image.colors.assign(pixels, 0);
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    drawObject(scene.objects[i], static_cast<int>(i), T_world_camera, image);
  std::size_t i = 0;
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column, ++i) {
      if (image.object[i] < 0) continue;
      const Vector3 ray((column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, 1.0);
      shadePixel(scene, T_world_camera, i, ray, image);
    }
  return image;
}

bool intersect(const SceneObject& object, const Vector3& origin, const Vector3& direction,
               double& t, int& face) {
  const Pose T_object_world = object.T_world_object.inverse();
  const LocalRay ray{T_object_world * origin, T_object_world.linear() * direction};
  return hit(object.shape, ray, 0.5 * object.size, t, face);
}

}  // namespace evaluation
}  // namespace planar_mapping
