// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "evaluation/metrics/simulated_features.h"
#include "evaluation/simulation/ray_caster.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping::evaluation {
namespace {

SceneObject objectAt(Shape shape, const Vector3& center, const Vector3& size) {
  SceneObject object;
  object.shape = shape;
  object.T_world_object.translation() = center;
  object.size = size;
  return object;
}

PinholeCamera smallCamera() {
  return {40.0, 50.0, 31.5, 23.5, 64, 48};
}

TEST(Intersect, HitsTheFacesOfABox) {
  const SceneObject box = objectAt(Shape::Box, Vector3(5, 0, 0), Vector3(2, 4, 6));
  double t = 0.0;
  int face = -1;
  ASSERT_TRUE(intersect(box, Vector3(0, 0, 0), Vector3(1, 0, 0), t, face));
  EXPECT_DOUBLE_EQ(t, 4.0);
  EXPECT_EQ(face, 0);
  ASSERT_TRUE(intersect(box, Vector3(10, 0, 0), Vector3(-2, 0, 0), t, face));
  EXPECT_DOUBLE_EQ(t, 2.0);
  EXPECT_EQ(face, 1);
  ASSERT_TRUE(intersect(box, Vector3(5, -10, 1), Vector3(0, 1, 0), t, face));
  EXPECT_DOUBLE_EQ(t, 8.0);
  EXPECT_EQ(face, 2);
  ASSERT_TRUE(intersect(box, Vector3(5, 0, 10), Vector3(0, 0, -1), t, face));
  EXPECT_DOUBLE_EQ(t, 7.0);
  EXPECT_EQ(face, 5);
  EXPECT_FALSE(intersect(box, Vector3(0, 3, 0), Vector3(1, 0, 0), t, face));
  EXPECT_FALSE(intersect(box, Vector3(0, 0, 0), Vector3(-1, 0, 0), t, face)) << "behind";
  EXPECT_FALSE(intersect(box, Vector3(5, 0, 0), Vector3(1, 0, 0), t, face)) << "inside";
}

TEST(Intersect, HitsCylinderAndSphere) {
  const SceneObject cylinder = objectAt(Shape::Cylinder, Vector3(0, 0, 1), Vector3(2, 2, 2));
  double t = 0.0;
  int face = -1;
  ASSERT_TRUE(intersect(cylinder, Vector3(-5, 0, 1), Vector3(1, 0, 0), t, face));
  EXPECT_DOUBLE_EQ(t, 4.0);
  EXPECT_EQ(face, kCurvedFace);
  ASSERT_TRUE(intersect(cylinder, Vector3(0.5, 0.5, 5), Vector3(0, 0, -1), t, face));
  EXPECT_DOUBLE_EQ(t, 3.0);
  EXPECT_EQ(face, 5);
  EXPECT_FALSE(intersect(cylinder, Vector3(0.8, 0.8, 5), Vector3(0, 0, -1), t, face));
  EXPECT_FALSE(intersect(cylinder, Vector3(-5, 0, 2.5), Vector3(1, 0, 0), t, face));
  const SceneObject sphere = objectAt(Shape::Sphere, Vector3(0, 0, 0), Vector3(2, 2, 2));
  ASSERT_TRUE(intersect(sphere, Vector3(0, 0, -3), Vector3(0, 0, 0.5), t, face));
  EXPECT_DOUBLE_EQ(t, 4.0);
  EXPECT_FALSE(intersect(sphere, Vector3(0, 1.1, -3), Vector3(0, 0, 1), t, face));
}

TEST(Intersect, FollowsRigidMotion) {
  Random random(5);
  const SceneObject still = objectAt(Shape::Box, Vector3(1, 2, 3), Vector3(1, 2, 0.5));
  for (int i = 0; i < 200; ++i) {
    Pose T = Pose::Identity();
    T.linear() = Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), 1.0)
                     .normalized()
                     .toRotationMatrix();
    T.translation() = Vector3(random.normal(), random.normal(), random.normal());
    SceneObject moved = still;
    moved.T_world_object = T * still.T_world_object;
    const Vector3 origin(-4.0, 1.0 + random.normal(), 3.0 + random.normal());
    const Vector3 direction(1.0, 0.3 * random.normal(), 0.3 * random.normal());
    double t = 0.0, t_moved = 0.0;
    int face = 0, face_moved = 0;
    const bool hit = intersect(still, origin, direction, t, face);
    ASSERT_EQ(intersect(moved, T * origin, T.linear() * direction, t_moved, face_moved), hit);
    if (!hit) continue;
    EXPECT_NEAR(t_moved, t, 1e-9);
    EXPECT_EQ(face_moved, face);
  }
}

TEST(Render, AgreesWithTestingEveryObjectForEveryPixel) {
  const Scene scene = makeScene("room", 5);
  const PinholeCamera camera = smallCamera();
  for (const Pose& pose : scene.path) {
    const Rendering view = render(scene, camera, pose);
    for (int row = 0; row < camera.height; row += 3) {
      for (int column = 0; column < camera.width; column += 3) {
        const Vector3 ray((column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, 1.0);
        double nearest = 1e9;
        for (const SceneObject& object : scene.objects) {
          double t = 0.0;
          int face = 0;
          if (intersect(object, pose.translation(), pose.linear() * ray, t, face))
            nearest = std::min(nearest, t);
        }
        const std::size_t i = static_cast<std::size_t>(row * camera.width + column);
        if (nearest < 1e9) {
          ASSERT_GE(view.object[i], 0);
          EXPECT_NEAR(view.depth[i], nearest, 1e-5 * nearest);
        } else {
          EXPECT_EQ(view.object[i], -1);
          EXPECT_EQ(view.depth[i], 0.0f);
        }
      }
    }
  }
}

TEST(Render, LooksAlongTheOpticalAxis) {
  Scene scene;
  scene.objects.push_back(objectAt(Shape::Box, Vector3(0, 0, 5.5), Vector3(100, 100, 1)));
  scene.objects.push_back(objectAt(Shape::Box, Vector3(2.05, 0, 3), Vector3(4, 100, 0.5)));
  const Rendering view = render(scene, smallCamera(), Pose::Identity());
  // Right of the axis (x > 0.05) the nearer box, else the wall, its face towards the camera.
  const std::size_t row = 24 * 64;
  EXPECT_FLOAT_EQ(view.depth[row + 10], 5.0f);
  EXPECT_EQ(view.object[row + 10], 0);
  EXPECT_EQ(view.face[row + 10], 4);
  EXPECT_FLOAT_EQ(view.depth[row + 50], 2.75f);
  EXPECT_EQ(view.object[row + 50], 1);
  EXPECT_NEAR(view.incidence[row + 31], 1.0, 1e-3);
}

TEST(Render, BearsHugeFarAndFlatThings) {
  Scene scene;
  scene.objects.push_back(objectAt(Shape::Box, Vector3(0, 1e9 + 1.0, 0), Vector3(4e9, 2e9, 4e9)));
  scene.objects.push_back(objectAt(Shape::Sphere, Vector3(1e9, 0, 3e9), Vector3::Constant(1e9)));
  scene.objects.push_back(objectAt(Shape::Box, Vector3(0, 0, 2), Vector3(0.5, 0.5, 0.0)));
  scene.objects.push_back(objectAt(Shape::Cylinder, Vector3(0, 0, 1e9), Vector3(0, 0, 0)));
  for (const Pattern pattern :
       {Pattern::Plain, Pattern::Speckles, Pattern::Planks, Pattern::Tiles, Pattern::Bricks}) {
    for (SceneObject& object : scene.objects) {
      object.material.pattern = pattern;
      object.material.posters = 0.5;
      object.material.texture = 0.9;
    }
    RenderParams params;
    params.plain_fraction = 0.2;
    const Rendering view = render(scene, smallCamera(), Pose::Identity(), params);
    EXPECT_EQ(view.object[24 * 64 + 32], 2);
    EXPECT_FLOAT_EQ(view.depth[24 * 64 + 32], 2.0f);
    EXPECT_EQ(view.object[47 * 64 + 5], 0) << "the ground";
    EXPECT_NEAR(view.depth[47 * 64 + 5], 50.0 / 23.5, 1e-5);
    EXPECT_EQ(view.colors.size(), view.size());
  }
}

TEST(Render, RefusesWhatIsNotFinite) {
  Scene scene;
  scene.objects.push_back(objectAt(Shape::Box, Vector3(0, 0, 5), Vector3(1, 1, 1)));
  Pose nowhere = Pose::Identity();
  nowhere.translation().x() = std::nan("");
  EXPECT_THROW(render(scene, smallCamera(), nowhere), InputError);
  scene.objects[0].T_world_object = nowhere;
  EXPECT_THROW(render(scene, smallCamera(), Pose::Identity()), InputError);
  scene.objects[0].T_world_object = Pose::Identity();
  scene.objects[0].size.y() = -1.0;
  EXPECT_THROW(render(scene, smallCamera(), Pose::Identity()), InputError);
  scene.objects.clear();
  const Rendering empty = render(scene, smallCamera(), Pose::Identity());
  for (const std::int32_t object : empty.object) EXPECT_EQ(object, -1);
}

TEST(Render, RefusesBadCameras) {
  PinholeCamera camera = smallCamera();
  camera.fx = 0.0;
  EXPECT_THROW(render(Scene(), camera, Pose::Identity()), ParameterError);
  camera = smallCamera();
  camera.width = 0;
  EXPECT_THROW(render(Scene(), camera, Pose::Identity()), ParameterError);
}

SimulationParams smallParams(const std::string& scene, int frames) {
  SimulationParams params;
  params.scene = scene;
  params.frames = frames;
  params.width = 160;
  params.height = 120;
  params.clouds = false;
  params.colors = false;
  return params;
}

SimulatedFeatureParams exact() {
  SimulatedFeatureParams params;
  params.noise_px = 0.0;
  params.miss_fraction = 0.0;
  return params;
}

TEST(SimulatedFeatures, StandWhereTheirLandmarksAre) {
  SimulationParams params = smallParams("corridor", 8);
  params.step = 0.1;
  const Simulation simulation(params);
  SimulatedFeatures features(simulation, exact());
  std::map<std::int64_t, Vector3> places;
  for (std::size_t k = 0; k < simulation.size(); ++k) {
    const SimulatedFrame frame = simulation.frame(k);
    const std::vector<KeyFeature> seen = features.next(frame);
    ASSERT_GT(seen.size(), 200u);
    std::set<std::int64_t> tracks;
    for (const KeyFeature& one : seen) {
      EXPECT_TRUE(tracks.insert(one.track).second);
      const Vector3 world = frame.T_world_camera * one.position;
      EXPECT_NEAR((world - places.emplace(one.track, world).first->second).norm(), 0.0, 1e-4);
      EXPECT_LE(one.sightings, static_cast<std::int32_t>(k) + 1);
    }
  }
}

TEST(SimulatedFeatures, ThingsThatLeaveTakeTheirFeaturesAlong) {
  SimulationParams params = smallParams("corridor", 10);
  params.path = Path::Standing;
  params.moving = true;
  const Simulation simulation(params);
  const auto onPerson = [&](const SimulatedFrame& frame, const KeyFeature& one) {
    const auto column = static_cast<std::size_t>(std::lround(one.column));
    const auto row = static_cast<std::size_t>(std::lround(one.row));
    const std::int32_t object = frame.truth.object[row * 160 + column];
    return object >= 0 && simulation.scene().objects[static_cast<std::size_t>(object)].name.rfind(
                              "person", 0) == 0;
  };
  SimulatedFeatureParams many = exact();
  many.per_frame = 2000;
  SimulatedFeatures features(simulation, many);
  const SimulatedFrame before = simulation.frame(0);
  std::set<std::int64_t> of_person;
  for (const KeyFeature& one : features.next(before))
    if (onPerson(before, one)) of_person.insert(one.track);
  EXPECT_GT(of_person.size(), 5u);
  for (const KeyFeature& one : features.next(simulation.frame(9)))
    EXPECT_EQ(of_person.count(one.track), 0u);
}

TEST(SimulatedFeatures, RefuseBadParametersAndFramesOutOfOrder) {
  const Simulation simulation(smallParams("room", 2));
  SimulatedFeatureParams params;
  params.per_frame = 0;
  EXPECT_THROW(SimulatedFeatures(simulation, params), ParameterError);
  params = SimulatedFeatureParams();
  params.miss_fraction = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(SimulatedFeatures(simulation, params), ParameterError);
  SimulatedFeatures features(simulation, SimulatedFeatureParams());
  EXPECT_THROW(features.next(SimulatedFrame()), InputError);
  features.next(simulation.frame(1));
  EXPECT_THROW(features.next(simulation.frame(0)), InputError);
  EXPECT_THROW(features.next(simulation.frame(1)), InputError);
}

}  // namespace
}  // namespace planar_mapping::evaluation
