// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/scene/picking.h"

#include <cmath>
#include <cstdio>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/geometry/oriented_box.h"

namespace planar_mapping {

Ray sightLine(const CameraView& camera, int width, int height, double x, double y) {
  const Vector3 direction = camera.direction();
  const Vector3 right = direction.cross(camera.view_up).normalized();
  const Vector3 up = right.cross(direction);
  const double aspect = static_cast<double>(width) / height;
  const double across = (2.0 * x / width - 1.0) * aspect;
  const double upwards = 1.0 - 2.0 * y / height;
  if (camera.parallel)
    return {camera.position + camera.parallel_scale * (across * right + upwards * up), direction};
  const double t = std::tan(0.5 * camera.view_angle);
  return {camera.position, (direction + t * (across * right + upwards * up)).normalized()};
}

double enters(const Ray& ray, const Cuboid& cuboid) {
  double first = 0.0;
  double last = INFINITY;
  return detail::clipToCuboid(cuboid, ray.origin, ray.direction, first, last) ? first : -1.0;
}

bool isCutAway(const Cuboid& cuboid, const CameraView& camera, const ViewOptions& options,
               const Vector3& up) {
  if (options.clip_above) {
    const double half = halfAlong(cuboid, up.normalized());
    if (heightOf(cuboid, up) - half > *options.clip_above) return true;
  }
  if (cuboid.plane_id < 0 || options.cutaway == Cutaway::None) return false;
  const Vector3 normal = cuboid.orientation * Vector3::UnitZ();
  if (options.cutaway == Cutaway::Ceiling) return normal.dot(up.normalized()) < -0.7;
  const Vector3 to_viewer =
      camera.parallel ? Vector3(-camera.direction()) : (camera.position - cuboid.center).eval();
  return normal.dot(to_viewer) < -0.05 * to_viewer.norm();
}

int pickCuboid(const SceneContent& content, const Ray& ray, const CameraView& camera,
               const ViewOptions& options) {
  int picked = -1;
  double nearest = INFINITY;
  for (std::size_t i = 0; options.show.occupied && i < content.cuboids.size(); ++i) {
    const Cuboid& cuboid = content.cuboids[i];
    const double distance = enters(ray, cuboid);
    // A viewer inside a cuboid looks out of it.
    if (distance <= 0.0 || distance >= nearest) continue;
    if (isCutAway(cuboid, camera, options, content.up)) continue;
    nearest = distance;
    picked = static_cast<int>(i);
  }
  return picked;
}

std::string describeCuboid(const SceneContent& content, int index) {
  if (index < 0 || static_cast<std::size_t>(index) >= content.cuboids.size())
    throw InputError("there is no cuboid " + std::to_string(index));
  const Cuboid& c = content.cuboids[static_cast<std::size_t>(index)];
  const std::string plane = c.plane_id < 0 ? "non-planar" : "plane " + std::to_string(c.plane_id);
  char text[400];
  std::snprintf(text, sizeof(text),
                "cuboid %d  (%s)\n"
                "centre       %.3f, %.3f, %.3f m\n"
                "size         %.3f x %.3f x %.3f m\n"
                "tilt         %.1f deg\n"
                "probability  %.2f\n"
                "state        %s",
                index, plane.c_str(), c.center.x(), c.center.y(), c.center.z(), c.size.x(),
                c.size.y(), c.size.z(), tiltOf(c, content.up) / kRadiansPerDegree,
                static_cast<double>(c.probability), toString(c.state));
  return text;
}

}  // namespace planar_mapping
