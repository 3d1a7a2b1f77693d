// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/simulation/scene.h"

#include <algorithm>
#include <cmath>

#include "evaluation/simulation/scene_builder.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping::evaluation {
namespace {

constexpr double kSameNormal = 1e-9;
constexpr double kSameOffset = 1e-6;
constexpr double kTurnPerMetre = 30.0;  ///< degrees turned on the spot in the time of a metre

double radians(double degrees) {
  return degrees * M_PI / 180.0;
}

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
  BuildScene* build;
};

constexpr KnownScene kScenes[] = {{"room", buildRoom},       {"corridor", buildCorridor},
                                  {"outdoor", buildOutdoor}, {"rooms", buildRooms},
                                  {"white", buildWhite},     {"building", buildBuilding}};

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
  requireInRange("floors", floors, 1, 20);
  requireInRange("rooms", rooms, 2, 200);
  requireInRange("walk", walk, 0, 10000);
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

void SceneBuilder::lookFrom(const Vector3& position, double yaw_deg, double pitch_deg) {
  const double yaw = radians(yaw_deg);
  const double pitch = radians(pitch_deg);
  const Vector3 forward(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch),
                        std::sin(pitch));
  const Vector3 right(std::sin(yaw), -std::cos(yaw), 0.0);
  Pose pose = Pose::Identity();
  pose.linear().col(0) = right;
  pose.linear().col(1) = forward.cross(right);
  pose.linear().col(2) = forward;
  pose.translation() = position;
  scene.path.push_back(pose);
  scene.camera_height = position.z();
}

void SceneBuilder::followLine(double length, const std::function<void(double, double)>& look) {
  const double turning = 180.0 / kTurnPerMetre;
  const double there = params.path == Path::Return ? length + turning : length;
  const bool returns = params.path == Path::Return || params.path == Path::Back;
  const double whole = returns ? there + length : length;
  const double step = params.step > 0.0   ? params.step
                      : params.frames > 1 ? whole / (params.frames - 1)
                                          : 0.0;
  for (int i = 0; i < params.frames; ++i) {
    const double way = params.path == Path::Standing ? 0.0 : std::min(i * step, whole);
    if (way <= length) {
      look(way / length, 0.0);
    } else if (way <= there) {
      look(1.0, kTurnPerMetre * (way - length));
    } else {
      look(std::max(0.0, whole - way) / length, params.path == Path::Return ? 180.0 : 0.0);
    }
  }
}

void SceneBuilder::followRound(double length, const std::function<void(double)>& look) {
  const double whole = params.path == Path::Return || params.path == Path::Back ? 2.0 : 1.0;
  const double step = params.step > 0.0 ? params.step / length : whole / params.frames;
  for (int i = 0; i < params.frames; ++i)
    look(params.path == Path::Standing ? 0.0 : std::min(i * step, whole));
}

int SceneBuilder::frameWhen(const std::function<bool(const Vector3&)>& passed,
                            double fraction) const {
  for (std::size_t i = 0; i < scene.path.size(); ++i)
    if (passed(scene.path[i].translation())) return static_cast<int>(i);
  return static_cast<int>(fraction * params.frames);
}

void SceneBuilder::onlyIn(std::size_t count, int first, int last) {
  for (std::size_t i = scene.objects.size() - count; i < scene.objects.size(); ++i) {
    scene.objects[i].first_frame = first;
    scene.objects[i].last_frame = last;
  }
}

void SceneBuilder::person(double x, double y, int leaves) {
  if (!params.moving) return;
  const Material coat{0x6A4F7B, Pattern::Speckles, 1.0};
  const Material skin{0xC79A7B, Pattern::Speckles, 0.8};
  moveTo(x, y);
  box("person_legs", Vector3(-0.12, -0.17, 0), Vector3(0.24, 0.34, 0.8), coat);
  box("person_body", Vector3(-0.15, -0.24, 0.8), Vector3(0.3, 0.48, 0.62), coat);
  sphere("person_head", Vector3(0, 0, 1.57), 0.26, skin);
  onlyIn(3, 0, std::max(1, leaves) - 1);
}

}  // namespace planar_mapping::evaluation
