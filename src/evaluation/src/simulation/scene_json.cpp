// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/scene_json.h"

#include <charconv>
#include <initializer_list>
#include <limits>

namespace planar_mapping {
namespace evaluation {
namespace {

std::string text(double value) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

std::string list(std::initializer_list<double> values) {
  std::string all;
  for (const double value : values) all += (all.empty() ? "" : ", ") + text(value);
  return "[" + all + "]";
}

const char* nameOf(Shape shape) {
  return shape == Shape::Box ? "box" : shape == Shape::Cylinder ? "cylinder" : "sphere";
}

std::string objectJson(const SceneObject& object, const std::vector<int>& plane_of_face) {
  const Vector3 c = object.T_world_object.translation();
  const Eigen::Quaterniond q(Matrix3(object.T_world_object.linear()));
  std::string planes;
  for (const int plane : plane_of_face)
    if (plane >= 0) planes += (planes.empty() ? "" : ", ") + std::to_string(plane);
  std::string stay;
  if (object.first_frame > 0) stay += ", \"first_frame\": " + std::to_string(object.first_frame);
  if (object.last_frame < std::numeric_limits<int>::max())
    stay += ", \"last_frame\": " + std::to_string(object.last_frame);
  return "{\"name\": \"" + object.name + "\", \"shape\": \"" + nameOf(object.shape) +
         "\", \"center\": " + list({c.x(), c.y(), c.z()}) +
         ", \"size\": " + list({object.size.x(), object.size.y(), object.size.z()}) +
         ", \"orientation\": " + list({q.x(), q.y(), q.z(), q.w()}) + ", \"planes\": [" + planes +
         "]" + stay + "}";
}

}  // namespace

std::string sceneJson(const SimulationParams& params, const Scene& scene,
                      const ScenePlanes& planes) {
  const PinholeCamera camera = params.camera();
  std::string json =
      "{\n\"scene\": \"" + scene.name + "\",\n\"frames\": " + std::to_string(scene.path.size()) +
      ",\n\"seed\": " + std::to_string(params.seed) + ",\n\"yaw_rad\": " + text(params.yaw) +
      ",\n\"camera_height_m\": " + text(scene.camera_height) +
      ",\n\"camera\": {\"width\": " + std::to_string(camera.width) +
      ", \"height\": " + std::to_string(camera.height) + ", \"fx\": " + text(camera.fx) +
      ", \"fy\": " + text(camera.fy) + ", \"cx\": " + text(camera.cx) +
      ", \"cy\": " + text(camera.cy) + ", \"baseline_m\": " + text(params.sensor.baseline) +
      ", \"noise_px\": " + text(params.sensor.noise_px) +
      "},\n\"depth_gt_scale\": " + text(kTruthDepthScale) + ",\n\"objects\": [\n";
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    json += objectJson(scene.objects[i], planes.plane_of_face[i]) +
            (i + 1 < scene.objects.size() ? ",\n" : "\n");
  json += "],\n\"planes\": [\n";
  for (std::size_t i = 0; i < planes.planes.size(); ++i) {
    const Plane& plane = planes.planes[i];
    json += "{\"id\": " + std::to_string(i) + ", \"coefficients\": " +
            list({plane.normal.x(), plane.normal.y(), plane.normal.z(), plane.offset}) + "}" +
            (i + 1 < planes.planes.size() ? ",\n" : "\n");
  }
  return json + "]\n}\n";
}

}  // namespace evaluation
}  // namespace planar_mapping
