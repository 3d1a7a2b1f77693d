// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "surface_shading.h"

#include <algorithm>
#include <cmath>

#include "surface_texture.h"

namespace planar_mapping {
namespace evaluation {
namespace {

constexpr double kLargestStretch = 8.0;  ///< samples along a pixel's image on a grazed surface
constexpr double kSmallestCosine = 1e-3;

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

/// The pattern averaged over the pixel's image on the surface: a parallelogram with sides
/// \p across and \p down (metres of u, v), covered by squares along its longer side.
double averaged(const SceneObject& object, bool flat, const SurfaceFrame& frame, Vector2 across,
                Vector2 down, double contrast, std::uint32_t seed) {
  if (across.squaredNorm() < down.squaredNorm()) std::swap(across, down);
  const double area = std::abs(across.x() * down.y() - across.y() * down.x());
  const double length = across.norm();
  const double width = std::max(area / std::max(length, 1e-12), length / kLargestStretch);
  const int samples = std::max(1, static_cast<int>(std::lround(length / width)));
  double sum = 0.0;
  for (int i = 0; i < samples; ++i) {
    const double share = (i + 0.5) / samples - 0.5;
    sum += brightnessAt(object.material, frame.u + share * across.x(), frame.v + share * across.y(),
                        width, contrast, flat, seed);
  }
  return sum / samples;
}

}  // namespace

SurfacePoint surfacePointAt(const ObjectView& view, int face, double depth, const Vector3& ray,
                            double pixel_x, double pixel_y, double plain_share, bool colors) {
  const SceneObject& object = *view.object;
  const Vector3 direction = view.R_object_camera * ray;
  const Vector3 local = view.origin + depth * direction;
  const bool flat = face < kCurvedFace;
  const SurfaceFrame frame = flat ? flatFrame(object, face, local) : roundFrame(object, local);
  const double length = direction.norm();
  const double toward = -frame.normal.dot(direction);
  SurfacePoint point;
  point.incidence = std::clamp(toward / length, 0.0, 1.0);
  const auto seed = static_cast<std::uint32_t>(view.index * 64 + face);
  point.texture = textureAt(object.material, frame.u, frame.v, plain_share, seed);
  if (!colors) return point;

  // A step of one pixel moves the ray, and its end along the ray so that it stays on the surface.
  const double slope = std::max(toward, kSmallestCosine * length);
  const auto stepOnSurface = [&](const Vector3& step) {
    const Vector3 moved = depth * (step + direction * (frame.normal.dot(step) / slope));
    return Vector2(frame.along_u.dot(moved), frame.along_v.dot(moved));
  };
  const Vector2 across = stepOnSurface(view.R_object_camera.col(0) * pixel_x);
  const Vector2 down = stepOnSurface(view.R_object_camera.col(1) * pixel_y);
  const double light = 0.62 + 0.33 * std::max(0.0, frame.normal.dot(view.light)) +
                       0.12 * std::max(0.0, -frame.normal.dot(view.light));
  point.brightness = light * averaged(object, flat, frame, across, down, point.texture, seed);
  return point;
}

std::uint32_t shaded(std::uint32_t color, double brightness) {
  std::uint32_t result = 0;
  for (const unsigned shift : {16u, 8u, 0u}) {
    const double channel = static_cast<double>(color >> shift & 0xFFu) * brightness;
    result |= static_cast<std::uint32_t>(std::clamp(channel, 0.0, 255.0) + 0.5) << shift;
  }
  return result;
}

}  // namespace evaluation
}  // namespace planar_mapping
