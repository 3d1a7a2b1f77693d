// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/scene.h"

#include <gtest/gtest.h>

#include <cmath>

#include "planar_mapping/core/error.h"
#include "planar_mapping/evaluation/ray_caster.h"

namespace planar_mapping {
namespace evaluation {
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

TEST(Scene, UnknownNamesAndNoFramesAreRefused) {
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

TEST(Scene, RotationMovesWorldAndPathTogether) {
  const Scene still = makeScene("room", 3);
  Scene turned = still;
  turned.rotate(0.6);
  PinholeCamera camera;
  camera.fx = camera.fy = 40.0;
  camera.cx = 31.5;
  camera.cy = 23.5;
  camera.width = 64;
  camera.height = 48;
  const Rendering before = render(still, camera, still.path[1]);
  const Rendering after = render(turned, camera, turned.path[1]);
  std::size_t different = 0;
  for (std::size_t i = 0; i < before.size(); ++i)
    different += std::abs(before.depth[i] - after.depth[i]) > 1e-4f ? 1 : 0;
  EXPECT_LE(different, 5u) << "only pixels on an edge may fall to the other side";
  EXPECT_EQ(planesOf(turned).planes.size(), planesOf(still).planes.size());
}

}  // namespace
}  // namespace evaluation
}  // namespace planar_mapping
