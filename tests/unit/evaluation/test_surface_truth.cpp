// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/metrics/surface_truth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping::evaluation {
namespace {

SceneObject solid(Shape shape, const Vector3& center, const Vector3& size) {
  SceneObject object;
  object.name = "solid";
  object.shape = shape;
  object.T_world_object.translation() = center;
  object.size = size;
  return object;
}

Scene sceneOf(const std::vector<SceneObject>& objects) {
  Scene scene;
  scene.objects = objects;
  return scene;
}

/// Looks along +x of the world from the given place; x of the image is -y of the world.
Pose lookAlongX(const Vector3& position) {
  Pose pose = Pose::Identity();
  pose.linear() << -Vector3::UnitY(), -Vector3::UnitZ(), Vector3::UnitX();
  pose.translation() = position;
  return pose;
}

PinholeCamera smallCamera() {
  return {125.0, 125.0, 79.5, 59.5, 160, 120};
}

TEST(SurfaceTruth, DistanceToABoxByHand) {
  const SurfaceTruth truth(sceneOf({solid(Shape::Box, {1, 0, 0}, {2, 4, 6})}));
  EXPECT_NEAR(truth.distance({2.5, 0, 0}), 0.5, 1e-12);      // before a face
  EXPECT_NEAR(truth.distance({2.3, 2.4, 0}), 0.5, 1e-12);    // an edge
  EXPECT_NEAR(truth.distance({3.0, 4.0, 5.0}), 3.0, 1e-12);  // a corner: 1, 2, 2
  EXPECT_NEAR(truth.distance({1.0, 0, 0}), 1.0, 1e-12);      // its centre
  EXPECT_NEAR(truth.distance({1.0, 1.9, 0}), 0.1, 1e-12);    // inside, near +y
  EXPECT_NEAR(truth.distance({2.0, 2.0, 3.0}), 0.0, 1e-12);  // on a corner
}

TEST(SurfaceTruth, AgreesWithPointsSampledOnTheSurface) {
  Random random(4);
  std::vector<SceneObject> objects;
  for (const Shape shape : {Shape::Box, Shape::Cylinder, Shape::Sphere}) {
    SceneObject object = solid(shape, {random.uniform(-1, 1), random.uniform(-1, 1), 0},
                               shape == Shape::Sphere ? Vector3(1, 1, 1) : Vector3(0.8, 0.8, 1.4));
    object.T_world_object.linear() =
        Quaternion(random.normal(), random.normal(), random.normal(), random.normal())
            .normalized()
            .toRotationMatrix();
    objects.push_back(object);
  }
  for (const SceneObject& object : objects) {
    // Rays at the solid from all sides meet its surface at points that are nowhere inside.
    std::vector<Vector3> surface;
    while (surface.size() < 4000) {
      const Vector3 from =
          5.0 * Vector3(random.normal(), random.normal(), random.normal()).normalized();
      const Vector3 at(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
      double t = 0.0;
      int face = 0;
      const Vector3 origin = object.T_world_object.translation() + from;
      const Vector3 direction = object.T_world_object.translation() + at - origin;
      if (intersect(object, origin, direction, t, face)) surface.push_back(origin + t * direction);
    }
    const SurfaceTruth truth(sceneOf({object}));
    for (const Vector3& point : surface) ASSERT_NEAR(truth.distance(point), 0.0, 1e-9);
    for (int i = 0; i < 50; ++i) {
      const Vector3 p =
          object.T_world_object.translation() +
          Vector3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
      double nearest = 1e9;
      for (const Vector3& point : surface) nearest = std::min(nearest, (point - p).norm());
      EXPECT_LE(truth.distance(p), nearest + 1e-9);
      EXPECT_GT(truth.distance(p), nearest - 0.12);  // samples are about 4 cm apart
    }
  }
}

TEST(SurfaceTruth, NearIsTheSameAsALittleDistance) {
  Random random(9);
  const SurfaceTruth truth(makeScene("corridor", 4));
  int near = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3 p(random.uniform(-3, 18), random.uniform(-4, 4), random.uniform(-0.5, 3));
    for (const double margin : {0.0, 0.1, 0.5}) {
      ASSERT_EQ(truth.isNear(p, margin), truth.distance(p) <= margin);
      near += truth.isNear(p, margin) ? 1 : 0;
    }
  }
  EXPECT_GT(near, 1000);
}

TEST(SurfaceTruth, SolidsCountOnlyInTheFramesInWhichTheyAreThere) {
  SceneObject early = solid(Shape::Sphere, {0, 0, 0}, {2, 2, 2});
  early.last_frame = 4;
  SceneObject late = solid(Shape::Sphere, {10, 0, 0}, {2, 2, 2});
  late.first_frame = 5;
  const Scene scene = sceneOf({early, late});
  EXPECT_NEAR(SurfaceTruth(scene).distance({10, 0, 0}), 1.0, 1e-12);
  EXPECT_NEAR(SurfaceTruth(scene, 0, 4).distance({10, 0, 0}), 9.0, 1e-12);
  EXPECT_NEAR(SurfaceTruth(scene, 5, 9).distance({0, 0, 0}), 9.0, 1e-12);
  EXPECT_NEAR(SurfaceTruth(scene, 4, 5).distance({0, 0, 0}), 1.0, 1e-12);
  EXPECT_THROW(SurfaceTruth(scene, 5, 4), InputError);
}

TEST(SurfaceTruth, VisibleCellsOfAWallAreWhatTheImageShows) {
  // A wall with its face at x = 2 seen from 2 m: 160 x 120 pixels at f = 125 see 2.544 x 1.904 m
  // of it between the outermost pixel centres: y from -1.272 to 1.272, z from 0.048 to 1.952.
  const Scene scene = sceneOf({solid(Shape::Box, {2.5, 0, 1}, {1, 10, 10})});
  SurfaceTruth truth(scene);
  const Pose pose = lookAlongX({0, 0, 1});
  VisibleSurfaceParams params;
  params.ground_height = 0.0;
  truth.addView(render(scene, smallCamera(), pose), pose, params);
  const std::vector<VisibleCell> cells = truth.visibleCells(0.5);
  // One layer of cells, behind the face: rows -3 to 2 of y, 0 to 3 of z.
  ASSERT_EQ(cells.size(), 6u * 4u);
  std::size_t pixels = 0;
  for (const VisibleCell& cell : cells) {
    EXPECT_EQ(cell.cell.x, 4);
    EXPECT_NEAR(cell.point.x(), 2.0, 2e-4);
    EXPECT_NEAR(truth.distance(cell.point), 0.0, 2e-4);
    pixels += cell.pixels;
  }
  EXPECT_EQ(pixels, 160u * 120u);
  EXPECT_TRUE(std::is_sorted(cells.begin(), cells.end(),
                             [](const auto& a, const auto& b) { return a.cell < b.cell; }));
  // A second look at the same adds pixels, no cells.
  truth.addView(render(scene, smallCamera(), pose), pose, params);
  EXPECT_EQ(truth.visibleCells(0.5).size(), cells.size());
}

TEST(SurfaceTruth, GroundAndWhatIsFarAreNotVisible) {
  const Scene scene = sceneOf({solid(Shape::Box, {10, 0, -0.5}, {40, 40, 1}),
                               solid(Shape::Box, {2.5, 0, 1}, {1, 0.5, 2}),
                               solid(Shape::Box, {9.5, 0, 1}, {1, 20, 2})});
  const Pose pose = lookAlongX({0, 0, 0.4});
  SurfaceTruth truth(scene);
  VisibleSurfaceParams params;
  params.max_depth = 5.0;
  truth.addView(render(scene, smallCamera(), pose), pose, params);
  ASSERT_FALSE(truth.visibleCells(0.01).empty());
  for (const VisibleCell& cell : truth.visibleCells(0.01)) {
    EXPECT_GT(cell.point.z(), 0.05);
    EXPECT_NEAR(cell.point.x(), 2.0, 2e-4);
  }
  params.max_depth = 0.0;
  EXPECT_THROW(truth.addView(render(scene, smallCamera(), pose), pose, params), ParameterError);
  EXPECT_THROW(truth.visibleCells(0.0), ParameterError);
  Rendering torn = render(scene, smallCamera(), pose);
  torn.depth.pop_back();
  EXPECT_THROW(truth.addView(torn, pose), InputError);
}

TEST(SurfaceTruth, FarGoesByDepthNotByTheLengthOfTheRay) {
  // A wall across the view, 4 m deep: rays to its corners are longer than to another one's middle.
  const Scene scene = sceneOf({solid(Shape::Box, {4.5, 0, 1}, {1, 40, 40})});
  const Pose pose = lookAlongX({0, 0, 1});
  VisibleSurfaceParams params;
  params.max_depth = 4.01;
  SurfaceTruth reached(scene);
  reached.addView(render(scene, smallCamera(), pose), pose, params);
  double longest = 0.0;
  for (const VisibleCell& cell : reached.visibleCells(0.01))
    longest = std::max(longest, (cell.point - pose.translation()).norm());
  EXPECT_GT(longest, 4.5);
  params.max_depth = 3.99;
  SurfaceTruth beyond(scene);
  beyond.addView(render(scene, smallCamera(), pose), pose, params);
  EXPECT_TRUE(beyond.visibleCells(0.01).empty());
}

TEST(SurfaceTruth, GrazedSurfaceCanBeLeftOut) {
  // A wall along the line of sight, 1 m to the left: the cosine falls below 0.3 beyond 3.2 m.
  const Scene scene = sceneOf({solid(Shape::Box, {10, 1.5, 1}, {30, 1, 4})});
  const Pose pose = lookAlongX({0, 0, 1});
  SurfaceTruth truth(scene);
  VisibleSurfaceParams params;
  params.min_incidence = 0.3;
  truth.addView(render(scene, smallCamera(), pose), pose, params);
  double farthest = 0.0;
  for (const VisibleCell& cell : truth.visibleCells(0.01))
    farthest = std::max(farthest, cell.point.x());
  EXPECT_GT(farthest, 2.9);
  EXPECT_LT(farthest, std::sqrt(1.0 / 0.09 - 1.0) + 1e-3);
}

TEST(SurfaceTruth, RefusesSolidsWithoutPlaceOrSize) {
  EXPECT_THROW(SurfaceTruth(sceneOf({solid(Shape::Box, {0, 0, 0}, {1, -1, 1})})), InputError);
  EXPECT_THROW(SurfaceTruth(sceneOf({solid(
                   Shape::Box, {std::numeric_limits<double>::quiet_NaN(), 0, 0}, {1, 1, 1})})),
               InputError);
}

}  // namespace
}  // namespace planar_mapping::evaluation
