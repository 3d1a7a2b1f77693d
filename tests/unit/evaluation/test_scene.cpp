// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/simulation/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "evaluation/simulation/ray_caster.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping::evaluation {
namespace {

TEST(Scene, EveryNameBuildsASceneWithItsPath) {
  for (const std::string& name : sceneNames()) {
    for (const int frames : {1, 7}) {
      const Scene scene = makeScene(name, frames);
      EXPECT_EQ(scene.name, name);
      EXPECT_EQ(scene.path.size(), static_cast<std::size_t>(frames));
      EXPECT_GT(scene.objects.size(), 20u);
      for (const SceneObject& object : scene.objects) {
        EXPECT_GT(object.size.minCoeff(), 0.0) << object.name;
        EXPECT_NEAR(object.T_world_object.linear().determinant(), 1.0, 1e-12) << object.name;
      }
      for (const Pose& pose : scene.path) {
        EXPECT_NEAR(pose.linear().determinant(), 1.0, 1e-12);
        // Camera axes: x to the right lies level, y points down.
        EXPECT_NEAR(pose.linear().col(0).z(), 0.0, 1e-12);
        EXPECT_LT(pose.linear().col(1).z(), 0.0);
        EXPECT_NEAR(pose.translation().z(), scene.camera_height, 1e-12);
      }
    }
  }
  EXPECT_EQ(makeScene("corridor", 1).camera_height, 0.37);
  EXPECT_EQ(makeScene("outdoor", 1).camera_height, 0.37);
}

TEST(Scene, CameraNeverStandsInsideAnything) {
  for (const std::string& name : sceneNames()) {
    const Scene scene = makeScene(name, 25);
    for (const Pose& pose : scene.path) {
      for (const SceneObject& object : scene.objects) {
        const Vector3 local = object.T_world_object.inverse() * pose.translation();
        const bool inside = (local.cwiseAbs() - 0.5 * object.size).maxCoeff() < 0.1;
        EXPECT_FALSE(inside) << name << ": " << object.name;
      }
    }
  }
}

TEST(Scene, WalksThroughABuildingGoDifferentWaysThroughTheSameRooms) {
  SceneParams params;
  params.scene = "building";
  params.frames = 2000;
  const Scene first = makeScene(params);
  params.walk = 1;
  const Scene second = makeScene(params);
  ASSERT_EQ(first.objects.size(), second.objects.size());
  for (std::size_t i = 0; i < first.objects.size(); ++i)
    EXPECT_EQ(first.objects[i].size, second.objects[i].size);
  double apart = 0.0, highest = 0.0;
  for (std::size_t i = 0; i < 2000; ++i) {
    apart = std::max(apart, (first.path[i].translation() - second.path[i].translation()).norm());
    highest = std::max(highest, first.path[i].translation().z());
    if (i > 0) {
      EXPECT_LT((first.path[i].translation() - first.path[i - 1].translation()).norm(), 0.16);
    }
    for (const SceneObject& object : first.objects) {
      const Vector3 local = object.T_world_object.inverse() * first.path[i].translation();
      ASSERT_GT((local.cwiseAbs() - 0.5 * object.size).maxCoeff(), 0.05) << object.name;
    }
  }
  EXPECT_GT(apart, 5.0);
  EXPECT_GT(highest, 6.0) << "the third floor";
}

TEST(Scene, PeopleWalkAheadThroughTheBuildingAndLeave) {
  SceneParams params;
  params.scene = "building";
  params.frames = 300;
  params.moving = true;
  const Scene scene = makeScene(params);
  int with_somebody = 0;
  for (int frame = 0; frame < params.frames; ++frame) {
    const Vector3 eyes = scene.path[static_cast<std::size_t>(frame)].translation();
    int people = 0;
    for (const SceneObject& object : scene.objects) {
      if (object.name != "person" || !object.isThere(frame)) continue;
      ++people;
      const Vector3 foot = object.T_world_object * Vector3(0, 0, -0.5 * object.size.z());
      EXPECT_GT((foot - eyes).head<2>().norm() + std::abs(foot.z() - eyes.z() + 1.2), 0.8);
      EXPECT_LT((foot - eyes).head<2>().norm(), 16 * 0.15 + 1e-9);
    }
    EXPECT_LE(people, 1);
    with_somebody += people;
  }
  EXPECT_GT(with_somebody, 100);
  EXPECT_LT(with_somebody, 201) << "40 of 60 frames";
}

SceneParams paramsOf(const std::string& name, int frames, Path path) {
  SceneParams params;
  params.scene = name;
  params.frames = frames;
  params.path = path;
  return params;
}

double yawOf(const Pose& pose) {
  return std::atan2(pose.linear()(1, 2), pose.linear()(0, 2));
}

TEST(Scene, AReturningCameraComesBackTurnedAround) {
  for (const std::string name : {"corridor", "outdoor", "rooms"}) {
    const Scene scene = makeScene(paramsOf(name, 101, Path::Return));
    const Pose& first = scene.path.front();
    const Pose& last = scene.path.back();
    EXPECT_LT((first.translation() - last.translation()).norm(), 1e-9) << name;
    EXPECT_NEAR(std::cos(yawOf(last) - yawOf(first)), -1.0, 1e-9) << name;
    for (std::size_t i = 1; i < scene.path.size(); ++i) {
      const double turn = std::acos(std::clamp(
          scene.path[i].linear().col(2).dot(scene.path[i - 1].linear().col(2)), -1.0, 1.0));
      EXPECT_LT(turn, 0.4) << name << " " << i;
    }
  }
}

TEST(Scene, TheStepIsTheDistanceBetweenFrames) {
  SceneParams params = paramsOf("corridor", 50, Path::Forward);
  params.step = 0.1;
  const Scene scene = makeScene(params);
  for (std::size_t i = 1; i < scene.path.size(); ++i)
    EXPECT_NEAR((scene.path[i].translation() - scene.path[i - 1].translation()).norm(), 0.1, 0.02);
  params.frames = 200;  // 19.9 m do not fit: the rest is spent at the end
  EXPECT_TRUE(makeScene(params).path.back().isApprox(makeScene("corridor", 2).path.back(), 1e-9));
}

TEST(Scene, ALongCorridorIsAsLongAsAskedFor) {
  SceneParams params = paramsOf("corridor", 300, Path::Forward);
  params.length = 100.0;
  const Scene scene = makeScene(params);
  EXPECT_NEAR(scene.path.back().translation().x(), 95.5, 1e-9);
  EXPECT_EQ(scene.camera_height, 0.37);
  double t = 0.0;
  int face = 0;
  bool closed = false;
  for (const SceneObject& object : scene.objects)
    closed |= object.name == "wall_end" &&
              intersect(object, Vector3(50, 0, 0.37), Vector3(1, 0, 0), t, face) && t == 50.0;
  EXPECT_TRUE(closed);
  std::set<std::string> names;
  for (const SceneObject& object : scene.objects) {
    names.insert(object.name);
    for (const Pose& pose : scene.path) {
      const Vector3 local = object.T_world_object.inverse() * pose.translation();
      EXPECT_GT((local.cwiseAbs() - 0.5 * object.size).maxCoeff(), 0.1) << object.name;
    }
  }
  for (const char* name : {"wall", "door_leaf", "niche_back", "carton", "bin", "room_back"})
    EXPECT_EQ(names.count(name), 1u) << name;
  // Both sides are closed: rays to the side end at a wall, a door, a niche or a room behind a door.
  for (double x = 0.125; x < 99.0; x += 0.25) {
    for (const double side : {-1.0, 1.0}) {
      bool hit = false;
      for (const SceneObject& object : scene.objects)
        hit |= intersect(object, Vector3(x, 0, 1.0), Vector3(0, side, 0), t, face) && t < 4.2;
      EXPECT_TRUE(hit) << x << " " << side;
    }
  }
}

TEST(Scene, ThingsThatMoveAreInOnePlaceAtATime) {
  SceneParams params = paramsOf("corridor", 40, Path::Forward);
  params.moving = true;
  const Scene scene = makeScene(params);
  bool person_left = false;
  for (int frame = 0; frame < 40; ++frame) {
    int doors = 0;
    int persons = 0;
    const Pose& pose = scene.path[static_cast<std::size_t>(frame)];
    for (const SceneObject& object : scene.objects) {
      if (!object.isThere(frame)) continue;
      doors += object.name == "fire_door" ? 1 : 0;
      persons += object.name == "person_body" ? 1 : 0;
      const Vector3 local = object.T_world_object.inverse() * pose.translation();
      EXPECT_GT((local.cwiseAbs() - 0.5 * object.size).maxCoeff(), 0.1) << object.name << frame;
    }
    EXPECT_EQ(doors, 1);
    EXPECT_LE(persons, 1);
    person_left |= persons == 0;
  }
  EXPECT_TRUE(person_left);
  EXPECT_TRUE(scene.objects.size() > makeScene("corridor", 40).objects.size());
  const Scene outdoor = makeScene("outdoor", 10);
  for (const int frame : {0, 4, 5, 9}) {
    int cartons = 0;
    for (const SceneObject& object : outdoor.objects)
      cartons += object.name == "carton" && object.isThere(frame) ? 1 : 0;
    EXPECT_EQ(cartons, 1) << frame;
  }
}

TEST(Scene, UnknownNamesAndNoFramesAreRefused) {
  SceneParams params;
  params.length = 20.0;
  EXPECT_THROW(makeScene(params), ParameterError) << "only corridors have a length";
  params.scene = "corridor";
  params.length = 2.0;
  EXPECT_THROW(makeScene(params), ParameterError);
  params.length = 0.0;
  params.step = -1.0;
  EXPECT_THROW(makeScene(params), ParameterError);
  EXPECT_THROW(makeScene("attic", 1), InputError);
  EXPECT_THROW(makeScene("room", 0), ParameterError);
}

TEST(ScenePlanes, CoplanarFacesOfOneSideShareAPlane) {
  Scene scene;
  SceneObject box;
  box.size = Vector3(1, 1, 1);
  scene.objects.push_back(box);
  box.T_world_object.translation() = Vector3(3, 0, 0);
  scene.objects.push_back(box);
  box.shape = Shape::Cylinder;
  box.T_world_object.translation() = Vector3(6, 0, 0);
  scene.objects.push_back(box);
  box.shape = Shape::Sphere;
  scene.objects.push_back(box);
  const ScenePlanes planes = planesOf(scene);
  // Four shared sides, two ends of x each; the cylinder's ends are coplanar with the boxes' too.
  EXPECT_EQ(planes.planes.size(), 8u);
  for (const int face : {2, 3, 4, 5})
    EXPECT_EQ(planes.plane_of_face[0][static_cast<std::size_t>(face)],
              planes.plane_of_face[1][static_cast<std::size_t>(face)]);
  EXPECT_NE(planes.plane_of_face[0][1], planes.plane_of_face[1][0]);
  EXPECT_EQ(planes.plane_of_face[2][5], planes.plane_of_face[0][5]);
  EXPECT_EQ(planes.plane_of_face[2][kCurvedFace], -1);
  EXPECT_EQ(planes.plane_of_face[3][0], -1);
  const Plane& top = planes.planes[static_cast<std::size_t>(planes.plane_of_face[0][5])];
  EXPECT_EQ(top.normal, Vector3(0, 0, 1));
  EXPECT_DOUBLE_EQ(top.offset, -0.5);
}

}  // namespace
}  // namespace planar_mapping::evaluation
