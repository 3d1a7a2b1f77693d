// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/scene_json.h"

#include <limits>
#include <nlohmann/json.hpp>

namespace planar_mapping {
namespace evaluation {
namespace {

using Json = nlohmann::ordered_json;

Json listOf(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

const char* nameOf(Shape shape) {
  return shape == Shape::Box ? "box" : shape == Shape::Cylinder ? "cylinder" : "sphere";
}

Json objectJson(const SceneObject& object, const std::vector<int>& plane_of_face) {
  const Eigen::Quaterniond q(Matrix3(object.T_world_object.linear()));
  Json json = {{"name", object.name},
               {"shape", nameOf(object.shape)},
               {"center", listOf(object.T_world_object.translation())},
               {"size", listOf(object.size)},
               {"orientation", {q.x(), q.y(), q.z(), q.w()}},
               {"planes", Json::array()}};
  for (const int plane : plane_of_face)
    if (plane >= 0) json["planes"].push_back(plane);
  if (object.first_frame > 0) json["first_frame"] = object.first_frame;
  if (object.last_frame < std::numeric_limits<int>::max()) json["last_frame"] = object.last_frame;
  return json;
}

}  // namespace

std::string sceneJson(const SimulationParams& params, const Scene& scene,
                      const ScenePlanes& planes) {
  const PinholeCamera camera = params.camera();
  Json json = {{"scene", scene.name},
               {"frames", scene.path.size()},
               {"seed", params.seed},
               {"yaw_rad", params.yaw},
               {"camera_height_m", scene.camera_height},
               {"camera",
                {{"width", camera.width},
                 {"height", camera.height},
                 {"fx", camera.fx},
                 {"fy", camera.fy},
                 {"cx", camera.cx},
                 {"cy", camera.cy},
                 {"baseline_m", params.sensor.baseline},
                 {"noise_px", params.sensor.noise_px}}},
               {"depth_gt_scale", kTruthDepthScale},
               {"objects", Json::array()},
               {"planes", Json::array()}};
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    json["objects"].push_back(objectJson(scene.objects[i], planes.plane_of_face[i]));
  for (const Plane& plane : planes.planes) {
    const Vector3& n = plane.normal;
    json["planes"].push_back(
        {{"id", json["planes"].size()}, {"coefficients", {n.x(), n.y(), n.z(), plane.offset}}});
  }
  return json.dump(1) + "\n";
}

}  // namespace evaluation
}  // namespace planar_mapping
