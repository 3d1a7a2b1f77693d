// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/scene.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/core/base/error.h"
#include "simulation/scene_builder.h"

namespace planar_mapping::evaluation {
namespace {

constexpr double kSameNormal = 1e-9;
constexpr double kSameOffset = 1e-6;

Plane planeOfFace(const SceneObject& object, int face) {
  const int axis = face / 2;
  Vector3 normal = Vector3::Zero();
  normal[axis] = face % 2 == 0 ? -1.0 : 1.0;
  const Vector3 on_face = 0.5 * object.size[axis] * normal;
  Plane plane;
  plane.normal = object.T_world_object.linear() * normal;
  plane.offset = -plane.normal.dot(object.T_world_object * on_face);
  return plane;
}

bool same(const Plane& a, const Plane& b) {
  return (a.normal - b.normal).squaredNorm() < kSameNormal * kSameNormal &&
         std::abs(a.offset - b.offset) < kSameOffset;
}

struct KnownScene {
  const char* name;
  void (*build)(SceneBuilder& builder);
};

constexpr KnownScene kScenes[] = {{"room", buildRoom},
                                  {"corridor", buildCorridor},
                                  {"outdoor", buildOutdoor},
                                  {"rooms", buildRooms},
                                  {"white", buildWhite}};

}  // namespace

void Scene::rotate(double yaw) {
  Pose turn = Pose::Identity();
  turn.linear() = Eigen::AngleAxisd(yaw, Vector3::UnitZ()).toRotationMatrix();
  for (SceneObject& object : objects) object.T_world_object = turn * object.T_world_object;
  for (Pose& pose : path) pose = turn * pose;
  light = turn.linear() * light;
  if (lamp) lamp = turn * *lamp;
}

ScenePlanes planesOf(const Scene& scene) {
  ScenePlanes result;
  for (const SceneObject& object : scene.objects) {
    std::vector<int> of_face(kCurvedFace + 1, -1);
    const int first = object.shape == Shape::Box ? 0 : object.shape == Shape::Cylinder ? 4 : 6;
    for (int face = first; face < kCurvedFace; ++face) {
      const Plane plane = planeOfFace(object, face);
      const auto known = std::find_if(result.planes.begin(), result.planes.end(),
                                      [&plane](const Plane& other) { return same(plane, other); });
      of_face[static_cast<std::size_t>(face)] = static_cast<int>(known - result.planes.begin());
      if (known == result.planes.end()) result.planes.push_back(plane);
    }
    result.plane_of_face.push_back(of_face);
  }
  return result;
}

const std::vector<std::string>& sceneNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const KnownScene& known : kScenes) all.emplace_back(known.name);
    return all;
  }();
  return names;
}

void SceneParams::validate() const {
  const std::vector<std::string>& names = sceneNames();
  if (std::find(names.begin(), names.end(), scene) == names.end()) {
    std::string all;
    for (const std::string& known : names) all += (all.empty() ? "" : ", ") + known;
    throw InputError("there is no scene '" + scene + "'; there are: " + all);
  }
  requireInRange("frames", frames, 1, 100000);
  requireInRange("step", step, 0.0, 1e3, "m");
  if (length != 0.0) {
    requireInRange("length", length, 8.0, 1000.0, "m");
    if (scene != "corridor") throw ParameterError("only the corridor has a length to choose");
  }
}

Scene makeScene(const SceneParams& params) {
  params.validate();
  SceneBuilder builder;
  builder.params = params;
  builder.scene.name = params.scene;
  for (const KnownScene& known : kScenes) {
    if (params.scene == known.name) known.build(builder);
  }
  return builder.scene;
}

Scene makeScene(const std::string& name, int frames) {
  SceneParams params;
  params.scene = name;
  params.frames = frames;
  return makeScene(params);
}

}  // namespace planar_mapping::evaluation
