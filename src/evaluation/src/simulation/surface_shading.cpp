// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/surface_shading.h"

#include <algorithm>
#include <cmath>

#include "simulation/surface_texture.h"

namespace planar_mapping {
namespace evaluation {
namespace {

constexpr int kLargestStretch = 8;      ///< samples along a pixel's image on a grazed surface
constexpr double kSmallestSide = 1e-6;  ///< of a pixel's image, metres
constexpr double kSmallestCosine = 1e-3;

/// Textures repeat after this many metres: their lattices count in 32 bits.
constexpr double kTexturePeriod = 4096.0;

/// Surface coordinates (metres) and how they change along the surface, object frame.
struct SurfaceFrame {
  Vector3 normal = Vector3::Zero();
  Vector3 along_u = Vector3::Zero();  ///< gradient of u
  Vector3 along_v = Vector3::Zero();  ///< gradient of v
  double u = 0.0;
  double v = 0.0;
};

SurfaceFrame flatFrame(const SceneObject& object, int face, const Vector3& local) {
  SurfaceFrame frame;
  const int axis = face / 2;
  frame.normal[axis] = face % 2 == 0 ? -1.0 : 1.0;
  int axis_u = axis == 0 ? 1 : 0;
  int axis_v = axis == 2 ? 1 : 2;
  // Wood is cut along its longer side.
  if (object.material.pattern == Pattern::Planks && object.size[axis_v] > object.size[axis_u])
    std::swap(axis_u, axis_v);
  frame.u = local[axis_u];
  frame.v = local[axis_v];
  frame.along_u[axis_u] = 1.0;
  frame.along_v[axis_v] = 1.0;
  return frame;
}

SurfaceFrame roundFrame(const SceneObject& object, const Vector3& local) {
  SurfaceFrame frame;
  frame.normal = local;
  if (object.shape == Shape::Cylinder) frame.normal.z() = 0.0;
  frame.normal.normalize();
  const double radius = 0.5 * object.size.x();
  frame.u = radius * std::atan2(local.y(), local.x());
  frame.v = local.z();
  const double squared = std::max(local.head<2>().squaredNorm(), 1e-6);
  frame.along_u = radius / squared * Vector3(-local.y(), local.x(), 0.0);
  frame.along_v = Vector3::UnitZ();
  return frame;
}

std::uint32_t scaled(std::uint32_t color, double brightness) {
  std::uint32_t result = 0;
  for (const unsigned shift : {16u, 8u, 0u}) {
    const double channel = static_cast<double>(color >> shift & 0xFFu) * brightness;
    result |= static_cast<std::uint32_t>(std::clamp(channel, 0.0, 255.0) + 0.5) << shift;
  }
  return result;
}

}  // namespace

SurfaceShader::SurfaceShader(const ObjectView& view, int face, const PinholeCamera& camera,
                             double plain_share, bool colors)
    : view_(view),
      face_(face),
      pixel_right_(view.R_object_camera.col(0) / camera.fx),
      pixel_down_(view.R_object_camera.col(1) / camera.fy),
      plain_share_(plain_share),
      colors_(colors),
      seed_(static_cast<std::uint32_t>(view.index * 64 + face)) {}

SurfacePatch SurfaceShader::patchAt(double depth, const Vector3& ray) const {
  const SceneObject& object = *view_.object;
  const Vector3 direction = view_.R_object_camera * ray;
  const Vector3 local = view_.origin + depth * direction;
  const SurfaceFrame frame =
      face_ < kCurvedFace ? flatFrame(object, face_, local) : roundFrame(object, local);
  const double length = direction.norm();
  const double toward = -frame.normal.dot(direction);
  SurfacePatch patch;
  patch.incidence = std::clamp(toward / length, 0.0, 1.0);
  patch.u = std::fmod(frame.u, kTexturePeriod);
  patch.v = std::fmod(frame.v, kTexturePeriod);
  patch.texture = textureAt(object.material, patch.u, patch.v, plain_share_, seed_);
  if (!colors_) return patch;
  if (view_.scene->lamp) {
    patch.light = lampLight(local, frame.normal, direction);
  } else {
    const double side = frame.normal.dot(view_.light);
    patch.light = 0.62 + (side > 0.0 ? 0.33 : -0.12) * side;
  }

  // A step of one pixel moves the ray, and its end along the ray so that it stays on the surface.
  const double slope = std::max(toward, kSmallestCosine * length);
  const auto stepOnSurface = [&](const Vector3& step, double& u, double& v) {
    const Vector3 moved = depth * (step + direction * (frame.normal.dot(step) / slope));
    u = std::clamp(frame.along_u.dot(moved), -kTexturePeriod, kTexturePeriod);
    v = std::clamp(frame.along_v.dot(moved), -kTexturePeriod, kTexturePeriod);
  };
  double across_u = 0.0, across_v = 0.0, down_u = 0.0, down_v = 0.0;
  stepOnSurface(pixel_right_, across_u, across_v);
  stepOnSurface(pixel_down_, down_u, down_v);
  const double area = std::abs(across_u * down_v - across_v * down_u);
  const double across = across_u * across_u + across_v * across_v;
  const double down = down_u * down_u + down_v * down_v;
  const double longer = std::sqrt(std::max(across, down));
  patch.along_u = across > down ? across_u : down_u;
  patch.along_v = across > down ? across_v : down_v;
  patch.width =
      std::max({area / std::max(longer, kSmallestSide), longer / kLargestStretch, kSmallestSide});
  patch.samples = std::clamp(static_cast<int>(longer / patch.width + 0.5), 1, kLargestStretch);
  return patch;
}

double SurfaceShader::lampLight(const Vector3& local, const Vector3& normal,
                                const Vector3& direction) const {
  constexpr double kAmbient = 0.5;
  constexpr double kDirect = 0.45;    // of a surface that faces the lamp at the usual distance,
  constexpr double kUsual = 2.0;      // metres,
  constexpr double kStrongest = 2.0;  // and no more than so many times that
  constexpr double kMirror = 80.0;    // exponent of the reflection
  const Scene& scene = *view_.scene;
  const Pose& T_world_object = view_.object->T_world_object;
  const Vector3 point = T_world_object * local + 1e-4 * (T_world_object.linear() * normal);
  const Vector3 to_lamp = *scene.lamp - point;
  const double distance = to_lamp.norm();
  const Vector3 n = T_world_object.linear() * normal;
  const double facing = n.dot(to_lamp) / distance;
  if (facing <= 0.0) return kAmbient;
  for (const SceneObject& object : scene.objects) {
    double t = 0.0;
    int face = 0;
    if (object.isThere(view_.frame) && intersect(object, point, to_lamp, t, face) && t < 1.0)
      return kAmbient;
  }
  const double fall_off = std::min(kStrongest, kUsual * kUsual / (distance * distance));
  const Vector3 ray = (T_world_object.linear() * direction).normalized();
  const double mirrored = std::max(0.0, (ray - 2.0 * n.dot(ray) * n).dot(to_lamp) / distance);
  return kAmbient + kDirect * facing * fall_off +
         view_.object->material.gloss * std::pow(mirrored, kMirror);
}

std::uint32_t SurfaceShader::colorOf(const SurfacePatch& patch) const {
  const Material& material = view_.object->material;
  double sum = 0.0;
  for (int k = 0; k < patch.samples; ++k) {
    const double along = (k + 0.5) / patch.samples - 0.5;
    sum += brightnessAt(material, face_ < kCurvedFace, seed_, patch.u + along * patch.along_u,
                        patch.v + along * patch.along_v, patch.width, patch.texture);
  }
  return scaled(material.color, patch.light * sum / patch.samples);
}

}  // namespace evaluation
}  // namespace planar_mapping
