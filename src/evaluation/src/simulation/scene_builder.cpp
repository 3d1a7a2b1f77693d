// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/scene_builder.h"

#include <cmath>

namespace planar_mapping {
namespace evaluation {
namespace {

constexpr double kPi = 3.14159265358979323846;

double radians(double degrees) {
  return degrees * kPi / 180.0;
}

}  // namespace

void SceneBuilder::moveTo(double x, double y, double z, double yaw_deg) {
  place.linear() = Eigen::AngleAxisd(radians(yaw_deg), Vector3::UnitZ()).toRotationMatrix();
  place.translation() = Vector3(x, y, z);
}

void SceneBuilder::box(const std::string& name, const Vector3& low, const Vector3& size,
                       const Material& material) {
  turnedBox(name, low + 0.5 * size, size, Eigen::AngleAxisd::Identity(), material);
}

void SceneBuilder::turnedBox(const std::string& name, const Vector3& center, const Vector3& size,
                             const Eigen::AngleAxisd& rotation, const Material& material) {
  SceneObject object;
  object.name = name;
  object.T_world_object = place;
  object.T_world_object.translation() = place * center;
  object.T_world_object.linear() = place.linear() * rotation.toRotationMatrix();
  object.size = size;
  object.material = material;
  scene.objects.push_back(object);
}

void SceneBuilder::cylinder(const std::string& name, const Vector3& foot, double diameter,
                            double height, const Material& material) {
  turnedBox(name, foot + Vector3(0, 0, 0.5 * height), Vector3(diameter, diameter, height),
            Eigen::AngleAxisd::Identity(), material);
  scene.objects.back().shape = Shape::Cylinder;
}

void SceneBuilder::sphere(const std::string& name, const Vector3& center, double diameter,
                          const Material& material) {
  turnedBox(name, center, Vector3::Constant(diameter), Eigen::AngleAxisd::Identity(), material);
  scene.objects.back().shape = Shape::Sphere;
}

void SceneBuilder::wallWithOpening(const std::string& name, double length, double height,
                                   double thickness, double opening_begin, double opening_end,
                                   double opening_low, double opening_high,
                                   const Material& material) {
  const double width = opening_end - opening_begin;
  box(name, Vector3(0, 0, 0), Vector3(opening_begin, thickness, height), material);
  box(name, Vector3(opening_end, 0, 0), Vector3(length - opening_end, thickness, height), material);
  if (opening_low > 0.0)
    box(name, Vector3(opening_begin, 0, 0), Vector3(width, thickness, opening_low), material);
  if (opening_high < height)
    box(name, Vector3(opening_begin, 0, opening_high),
        Vector3(width, thickness, height - opening_high), material);
}

}  // namespace evaluation
}  // namespace planar_mapping
