// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/visualization/picking.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../render/scenes.h"
#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

Cuboid turnedBox() {
  Cuboid cuboid;
  cuboid.center = {5.0, 0.0, 0.0};
  cuboid.size = {2.0, 1.0, 1.0};
  cuboid.orientation = Quaternion(Eigen::AngleAxisd(M_PI_2, Vector3::UnitZ()));
  return cuboid;
}

TEST(Enters, MeasuresToTheTurnedFace) {
  // Turned by 90 degrees the box is 1 m along x and 2 m along y.
  EXPECT_NEAR(enters({Vector3::Zero(), {1, 0, 0}}, turnedBox()), 4.5, 1e-12);
  EXPECT_NEAR(enters({{0.0, 0.99, 0.0}, {2, 0, 0}}, turnedBox()), 2.25, 1e-12);
  EXPECT_LT(enters({{0.0, 1.01, 0.0}, {1, 0, 0}}, turnedBox()), 0.0);
  EXPECT_LT(enters({Vector3::Zero(), {-1, 0, 0}}, turnedBox()), 0.0) << "behind the viewer";
  EXPECT_EQ(enters({{5.0, 0.0, 0.0}, {1, 0, 0}}, turnedBox()), 0.0) << "inside";
}

TEST(Enters, AgreesWithWalkingAlongTheRay) {
  Random random(3);
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    Cuboid cuboid;
    cuboid.center = {random.uniform(2, 4), random.uniform(-1, 1), random.uniform(-1, 1)};
    cuboid.size = {random.uniform(0.2, 2), random.uniform(0.2, 2), random.uniform(0.2, 2)};
    cuboid.orientation =
        Quaternion(random.normal(), random.normal(), random.normal(), random.normal());
    cuboid.orientation.normalize();
    const Ray ray{Vector3::Zero(), {1.0, random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3)}};
    double walked = -1.0;
    for (double t = 0.0; t < 8.0 && walked < 0.0; t += 1e-3) {
      if (contains(cuboid, ray.origin + t * ray.direction)) walked = t;
    }
    const double found = enters(ray, cuboid);
    // A corner may be thinner than the step.
    if (walked < 0.0) continue;
    ++hits;
    EXPECT_NEAR(found, walked, 2e-3);
  }
  EXPECT_GT(hits, 60);
}

TEST(SightLine, GoesThroughTheFocalPointInTheMiddle) {
  for (const bool parallel : {false, true}) {
    CameraView camera;
    camera.position = {1, 2, 3};
    camera.focal_point = {4, 2, 3};
    camera.parallel = parallel;
    const Ray middle = sightLine(camera, 200, 100, 100.0, 50.0);
    EXPECT_TRUE(middle.origin.isApprox(camera.position));
    EXPECT_TRUE(middle.direction.isApprox(Vector3(1, 0, 0)));
  }
}

TEST(SightLine, HasXToTheRightAndYDown) {
  CameraView camera;
  camera.position = Vector3::Zero();
  camera.focal_point = {1, 0, 0};  // looking along x: right is -y
  camera.view_angle = M_PI_2;
  const Ray corner = sightLine(camera, 200, 100, 200.0, 0.0);
  const Vector3 at = corner.direction / corner.direction.x();
  EXPECT_NEAR(at.y(), -2.0, 1e-12);
  EXPECT_NEAR(at.z(), 1.0, 1e-12);
  camera.parallel = true;
  camera.parallel_scale = 3.0;
  EXPECT_TRUE(sightLine(camera, 200, 100, 0.0, 100.0).origin.isApprox(Vector3(0, 6, -3)));
}

TEST(PickCuboid, FindsTheNearestVisibleOne) {
  SceneContent content;
  content.cuboids.push_back(testing::plate({5, 0, 0}, {-1, 0, 0}, 2, 2, 3));  // faces us
  content.cuboids.push_back(testing::plate({2, 0, 0}, {1, 0, 0}, 2, 2, 4));   // faces away
  CameraView camera;
  camera.position = Vector3::Zero();
  camera.focal_point = {1, 0, 0};
  const Ray ray = sightLine(camera, 100, 100, 50, 50);
  ViewOptions options;
  EXPECT_EQ(pickCuboid(content, ray, camera, options), 0) << "the near one is cut away";
  options.cutaway = Cutaway::None;
  EXPECT_EQ(pickCuboid(content, ray, camera, options), 1);
  options.show.occupied = false;
  EXPECT_EQ(pickCuboid(content, ray, camera, options), -1);
  EXPECT_EQ(pickCuboid(content, {Vector3::Zero(), {0, 0, 1}}, camera, ViewOptions()), -1);
}

TEST(IsCutAway, RemovesCeilingsAndWhatIsAbove) {
  const Vector3 up = Vector3::UnitZ();
  const Cuboid ceiling = testing::plate({0, 0, 2.5}, -up, 1, 1, 0);
  const Cuboid wall = testing::plate({0, 0, 1.0}, {1, 0, 0}, 1, 2, 0);
  CameraView below;
  below.position = {0, 0, 0};
  below.focal_point = {0, 0, 1};
  ViewOptions options;
  EXPECT_FALSE(isCutAway(ceiling, below, options, up)) << "seen from below it shows";
  options.cutaway = Cutaway::Ceiling;
  EXPECT_TRUE(isCutAway(ceiling, below, options, up));
  EXPECT_FALSE(isCutAway(wall, below, options, up));
  options.cutaway = Cutaway::None;
  options.clip_above = 2.0;
  EXPECT_TRUE(isCutAway(ceiling, below, options, up));
  EXPECT_FALSE(isCutAway(wall, below, options, up)) << "it starts below the height";
  Cuboid rubble = ceiling;
  rubble.plane_id = -1;
  options = ViewOptions();
  options.cutaway = Cutaway::Ceiling;
  EXPECT_FALSE(isCutAway(rubble, below, options, up)) << "non-planar cells have no seen side";
}

TEST(DescribeCuboid, SaysWhatARobotistAsks) {
  SceneContent content;
  content.cuboids.push_back(testing::plate({1, 2, 3}, {-1, 0, 1}, 0.8, 0.5, 7));
  content.cuboids[0].probability = 0.875f;
  const std::string text = describeCuboid(content, 0);
  for (const char* part : {"cuboid 0", "plane 7", "0.800 x 0.500 x 0.100 m", "45.0 deg", "0.88",
                           "occupied", "2.000"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
  }
  content.cuboids[0].plane_id = -1;
  EXPECT_NE(describeCuboid(content, 0).find("non-planar"), std::string::npos);
  EXPECT_THROW(describeCuboid(content, 1), InputError);
  EXPECT_THROW(describeCuboid(content, -1), InputError);
}

}  // namespace
}  // namespace planar_mapping
