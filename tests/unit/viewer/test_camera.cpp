// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "../../render/scenes.h"
#include "evaluation/metrics/cuboid_geometry.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/viewer/scene/camera.h"
#include "planar_mapping/viewer/scene/picking.h"

namespace planar_mapping {
namespace {

// Where a point is in the picture: (-1, -1) lower left to (1, 1) upper right.
Vector2 project(const CameraView& view, double aspect, const Vector3& p) {
  const Vector3 d = view.direction();
  const Vector3 right = d.cross(view.view_up);
  const Vector3 offset = p - view.position;
  const double half =
      view.parallel ? view.parallel_scale : offset.dot(d) * std::tan(0.5 * view.view_angle);
  return {offset.dot(right) / (half * aspect), offset.dot(view.view_up) / half};
}

TEST(PlaceCamera, ShowsEveryCornerInEveryPreset) {
  const SceneContent content = testing::room();
  for (const CameraPreset preset : {CameraPreset::Iso, CameraPreset::Top, CameraPreset::Front,
                                    CameraPreset::Back, CameraPreset::Left, CameraPreset::Right}) {
    for (const ColorBy color : {ColorBy::Plane, ColorBy::Height}) {
      ViewOptions options;
      options.camera = preset;
      options.color = color;
      const CameraView view = placeCamera(content, options);
      const double aspect = static_cast<double>(options.width) / options.height;
      double largest = 0.0;
      for (const Cuboid& cuboid : content.cuboids) {
        for (const Vector3& corner : corners(cuboid)) {
          const Vector2 at = project(view, aspect, corner);
          ASSERT_LE(at.cwiseAbs().maxCoeff(), 1.0) << toString(preset);
          largest = std::max(largest, at.cwiseAbs().maxCoeff());
        }
      }
      EXPECT_GT(largest, 0.5) << toString(preset) << ": the picture is nearly empty";
      EXPECT_NEAR(view.view_up.norm(), 1.0, 1e-9);
      EXPECT_NEAR(view.view_up.dot(view.direction()), 0.0, 1e-9);
    }
  }
}

TEST(PlaceCamera, LooksWhereThePresetSays) {
  const SceneContent content = testing::room();
  const auto direction = [&](CameraPreset preset) {
    ViewOptions options;
    options.camera = preset;
    return placeCamera(content, options).direction();
  };
  EXPECT_TRUE(direction(CameraPreset::Top).isApprox(Vector3(0, 0, -1)));
  EXPECT_TRUE(direction(CameraPreset::Front).isApprox(Vector3(0, 1, 0)));
  EXPECT_TRUE(direction(CameraPreset::Back).isApprox(Vector3(0, -1, 0)));
  EXPECT_TRUE(direction(CameraPreset::Left).isApprox(Vector3(1, 0, 0)));
  EXPECT_TRUE(direction(CameraPreset::Right).isApprox(Vector3(-1, 0, 0)));
  EXPECT_NEAR(direction(CameraPreset::Iso).z(), -std::sin(35.0 * M_PI / 180.0), 1e-9);
  ViewOptions top;
  top.camera = CameraPreset::Top;
  EXPECT_TRUE(placeCamera(content, top).view_up.isApprox(Vector3(0, 1, 0))) << "north is up";
}

TEST(PlaceCamera, TakesTheIsoViewFromWhereSurfacesWereSeen) {
  SceneContent content;
  content.cuboids.push_back(testing::plate({0, 0, 1}, {-1, -1, 0}, 4, 2, 0));
  const Vector3 to_viewer = -placeCamera(content, ViewOptions()).direction();
  EXPECT_GT(to_viewer.dot(Vector3(-1, -1, 0).normalized()), 0.7);
}

TEST(PlaceCamera, FirstPersonIsTheLastPose) {
  const SceneContent content = testing::room();
  ViewOptions options;
  options.camera = CameraPreset::FirstPerson;
  const CameraView view = placeCamera(content, options);
  const Pose& pose = content.trajectory.back();
  EXPECT_TRUE(view.position.isApprox(pose.translation()));
  EXPECT_TRUE(view.direction().isApprox(pose.linear().col(2), 1e-9)) << "optical axis";
  EXPECT_TRUE(view.view_up.isApprox(-pose.linear().col(1), 1e-9));
  SceneContent still = content;
  still.trajectory.clear();
  EXPECT_THROW(placeCamera(still, options), InputError);
}

TEST(PlaceCamera, ObeysPositionFocalPointAndViewUp) {
  ViewOptions options;
  options.camera_position = Vector3(10, 0, 1);
  options.focal_point = Vector3(0, 0, 1);
  options.view_up = Vector3(0, 1, 0);
  const CameraView view = placeCamera(testing::room(), options);
  EXPECT_EQ(view.position, *options.camera_position);
  EXPECT_TRUE(view.direction().isApprox(Vector3(-1, 0, 0)));
  EXPECT_TRUE(view.view_up.isApprox(Vector3(0, 1, 0)));
  options.view_up = Vector3(1, 0, 0);
  EXPECT_THROW(placeCamera(testing::room(), options), ParameterError);
  options.view_up.reset();
  options.focal_point = options.camera_position;
  EXPECT_THROW(placeCamera(testing::room(), options), ParameterError);
}

TEST(PlaceCamera, LooksStraightDownWithoutBeingTold) {
  ViewOptions options;
  options.camera_position = Vector3(3, 2, 10);
  options.focal_point = Vector3(3, 2, 0);
  const CameraView view = placeCamera(testing::room(), options);
  EXPECT_TRUE(view.view_up.allFinite());
  EXPECT_NEAR(view.view_up.z(), 0.0, 1e-9);
}

TEST(PlaceCamera, ZoomHalvesWhatIsSeen) {
  ViewOptions options;
  options.camera = CameraPreset::Top;
  const double whole = placeCamera(testing::room(), options).parallel_scale;
  options.zoom = 2.0;
  EXPECT_NEAR(placeCamera(testing::room(), options).parallel_scale, 0.5 * whole, 1e-12);
}

TEST(PlaceCamera, StrayCellsFarOutDoNotShrinkThePicture) {
  SceneContent content = testing::room();
  ViewOptions options;
  options.camera = CameraPreset::Top;
  const double before = placeCamera(content, options).parallel_scale;
  Cuboid stray = content.cuboids.front();
  stray.size.setConstant(0.1);
  stray.center += Vector3(200.0, 0.0, 0.0);
  content.cuboids.push_back(stray);
  EXPECT_EQ(placeCamera(content, options).parallel_scale, before);
  content.cuboids.back().size.setConstant(10.0);
  EXPECT_GT(placeCamera(content, options).parallel_scale, 5.0 * before) << "that is no stray cell";
  // A pole at the end of a floor belongs to it, however little surface it has.
  content.cuboids.assign(1, testing::plate({0, 0, 0}, {0, 0, 1}, 30, 30, 0, 0.1));
  options.camera = CameraPreset::Front;
  const double floor = placeCamera(content, options).parallel_scale;
  stray.center = Vector3(14.0, 0.0, 6.0);
  stray.size = Vector3(0.1, 0.1, 12.0);
  stray.orientation.setIdentity();
  content.cuboids.push_back(stray);
  EXPECT_NE(placeCamera(content, options).focal_point.z(), 0.0);
  EXPECT_GE(placeCamera(content, options).parallel_scale, floor);
}

TEST(PlaceCamera, OneFarPlaneAndTheOriginOfACloudAreNotFramed) {
  SceneContent content = testing::room();
  ViewOptions options;
  options.camera = CameraPreset::Top;
  content.trajectory.clear();
  Vector3 low, high, low_then, high_then;
  ASSERT_TRUE(content.bounds(low, high));
  const double before = placeCamera(content, options).parallel_scale;
  Cuboid far = testing::plate({200.0, 100.0, 0.0}, {0, 0, 1}, 1, 1, 77, 0.1);
  content.cuboids.push_back(far);
  content.trajectory.assign(1, Pose(Eigen::Translation3d(-90.0, 0.0, 0.0)));
  content.sensors_known = false;  // it is the origin of a merged cloud
  EXPECT_EQ(placeCamera(content, options).parallel_scale, before);
  ASSERT_TRUE(content.bounds(low_then, high_then));
  EXPECT_EQ(low, low_then);
  EXPECT_EQ(high, high_then);
}

TEST(PlaceCamera, RefusesAnEmptyScene) {
  EXPECT_THROW(placeCamera(SceneContent(), ViewOptions()), InputError);
}

TEST(PlaceCamera, CopesWithOnePointAndHugeCoordinates) {
  SceneContent content;
  content.clouds.push_back({{1e9f, -1e9f, 5.0f}, {}});
  const CameraView view = placeCamera(content, ViewOptions());
  EXPECT_TRUE(view.position.allFinite());
  EXPECT_GT((view.position - view.focal_point).norm(), 0.0);
}

TEST(HorizontalAxes, MakeARightHandedFrame) {
  Vector3 right, forward;
  horizontalAxes(Vector3::UnitZ(), right, forward);
  EXPECT_EQ(right, Vector3(1, 0, 0));
  EXPECT_EQ(forward, Vector3(0, 1, 0));
  horizontalAxes(-Vector3::UnitY(), right, forward);  // a camera's frame
  EXPECT_TRUE(right.isApprox(Vector3(1, 0, 0)));
  EXPECT_TRUE(forward.isApprox(Vector3(0, 0, 1)));
  for (const Vector3& up : {Vector3(1, 0, 0), Vector3(-1, 0, 0), Vector3(0.3, -0.9, 0.2)}) {
    horizontalAxes(up, right, forward);
    EXPECT_NEAR(right.dot(up), 0.0, 1e-12);
    EXPECT_TRUE(right.cross(forward).isApprox(up.normalized(), 1e-9));
  }
}

TEST(GroundHeight, IsZeroWhereTheMapStandsOnIt) {
  EXPECT_EQ(groundHeight(testing::room()), 0.0);
  SceneContent high;
  high.cuboids.push_back(testing::plate({0, 0, 5.8}, {0, 0, 1}, 1, 1, 0, 0.2));
  EXPECT_NEAR(groundHeight(high), 5.8, 1e-12);  // one stands on it
  EXPECT_EQ(groundHeight(SceneContent()), 0.0);
}

/// A floor is where the map has it, not where z is 0.
TEST(GroundHeight, IsThatOfTheLargestFloor) {
  SceneContent content;
  content.cuboids.push_back(testing::plate({0, 0, 0.55}, {0, 0, 1}, 2, 1.5, 0, 0.1));  // 3 m2
  EXPECT_NEAR(groundHeight(content), 0.55, 1e-9);
  content.cuboids.push_back(testing::plate({3, 0, 0.58}, {0.02, 0, 1}, 3, 1.5, 0, 0.1));
  EXPECT_NEAR(groundHeight(content), 0.568, 0.005);
  content.cuboids.push_back(testing::plate({0, 2, 0.5}, {0, 1, 0}, 2, 1, 1, 0.1));  // a wall on it
  EXPECT_NEAR(groundHeight(content), 0.568, 0.005);
  content.cuboids.push_back(testing::plate({0, 9, -2.0}, {0, 0, 1}, 4, 4, 2, 0.1));
  EXPECT_NEAR(groundHeight(content), -2.0, 1e-9);
}

/// A scan that leans: the street far away is lower than what the sensor stands on.
TEST(GroundHeight, IsThatAroundTheSensor) {
  SceneContent content;
  content.cuboids.push_back(testing::plate({6, 0, -1.9}, {0.02, 0, 1}, 8, 8, 0, 0.1));
  content.cuboids.push_back(testing::plate({80, 0, -4.0}, {0.02, 0, 1}, 20, 20, 0, 0.1));
  EXPECT_LT(groundHeight(content), -3.5);
  content.trajectory.push_back(Pose::Identity());
  // At the place of the floor next to the sensor, not in its middle.
  EXPECT_NEAR(groundHeight(content), -1.85, 0.06);
  content.trajectory[0].translation() = Vector3(80, 0, -2.0);
  EXPECT_NEAR(groundHeight(content), -3.95, 0.06);
  content.trajectory[0].translation() = Vector3(0, 0, -10.0);  // nothing is below: as without
  EXPECT_LT(groundHeight(content), -3.5);
}

TEST(GroundHeight, IgnoresAFewStrayCellsBelowTheFloor) {
  SceneContent content;
  content.cuboids.push_back(testing::plate({0, 0, 5.8}, {0, 0, 1}, 4, 4, 0, 0.2));
  Cuboid stray = test::cuboidAt(Vector3(1, 1, -3), Vector3(0.1, 0.1, 0.1));
  content.cuboids.push_back(stray);
  EXPECT_NEAR(groundHeight(content), 5.8, 1e-12);
}

Cuboid turnedBox() {
  Cuboid cuboid = test::cuboidAt({5.0, 0.0, 0.0}, {2.0, 1.0, 1.0});
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
    Cuboid cuboid =
        test::cuboidAt({random.uniform(2, 4), random.uniform(-1, 1), random.uniform(-1, 1)},
                       {random.uniform(0.2, 2), random.uniform(0.2, 2), random.uniform(0.2, 2)});
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
