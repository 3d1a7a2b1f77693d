// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/scene/scene_content.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../render/scenes.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

using testing::plate;

TEST(SceneContent, BoundsUseFullLengthsAndTurnWithTheCuboid) {
  SceneContent content;
  Cuboid cuboid;
  cuboid.center = {1.0, 2.0, 3.0};
  cuboid.size = {2.0, 4.0, 6.0};
  content.cuboids.push_back(cuboid);
  Vector3 low, high;
  ASSERT_TRUE(content.bounds(low, high));
  EXPECT_LT(low.norm(), 1e-12);
  EXPECT_TRUE(high.isApprox(Vector3(2.0, 4.0, 6.0)));
  content.cuboids[0].orientation = Quaternion(Eigen::AngleAxisd(M_PI_2, Vector3::UnitZ()));
  ASSERT_TRUE(content.bounds(low, high));
  EXPECT_TRUE(low.isApprox(Vector3(-1.0, 1.0, 0.0), 1e-12));
  EXPECT_TRUE(high.isApprox(Vector3(3.0, 3.0, 6.0), 1e-12));
}

TEST(SceneContent, BoundsIgnoreWhatIsNotFinite) {
  SceneContent content;
  Vector3 low, high;
  EXPECT_FALSE(content.bounds(low, high));
  content.clouds.push_back({{NAN, 0.0f, 0.0f, 1.0f, 2.0f, 3.0f}, {}});
  ASSERT_TRUE(content.bounds(low, high));
  EXPECT_EQ(low, Vector3(1.0, 2.0, 3.0));
  EXPECT_EQ(high, low);
}

TEST(SceneContent, ValidateNamesWhatCannotBeDrawn) {
  const auto broken = [](auto change) {
    SceneContent content = testing::room();
    change(content);
    EXPECT_THROW(content.validate(), InputError);
  };
  EXPECT_NO_THROW(testing::room().validate());
  broken([](SceneContent& c) { c.cuboids[3].center.x() = NAN; });
  broken([](SceneContent& c) { c.cuboids[3].size.z() = -0.1; });
  broken([](SceneContent& c) { c.cuboids[3].size.z() = INFINITY; });
  broken([](SceneContent& c) { c.cuboids[3].orientation.coeffs().setZero(); });
  broken([](SceneContent& c) { c.cuboids[3].probability = NAN; });
  broken([](SceneContent& c) { c.unknown[0].center.y() = INFINITY; });
  broken([](SceneContent& c) { c.trajectory[0].translation().x() = NAN; });
  broken([](SceneContent& c) { c.clouds.push_back({{1.0f, 2.0f}, {}}); });
  broken([](SceneContent& c) { c.clouds.push_back({{1.0f, 2.0f, 3.0f}, {1, 2}}); });
  broken([](SceneContent& c) { c.up.setZero(); });
}

TEST(TiltOf, IsTheAngleBetweenPlaneAndGround) {
  const Vector3 z = Vector3::UnitZ();
  EXPECT_NEAR(tiltOf(plate({0, 0, 0}, z, 1, 1, 0), z), 0.0, 1e-7);
  EXPECT_NEAR(tiltOf(plate({0, 0, 0}, -z, 1, 1, 0), z), 0.0, 1e-7) << "a ceiling is level";
  EXPECT_NEAR(tiltOf(plate({0, 0, 0}, {1, 0, 0}, 1, 1, 0), z), M_PI_2, 1e-7);
  EXPECT_NEAR(tiltOf(plate({0, 0, 0}, {-1, 0, 1}, 1, 1, 0), z), M_PI_4, 1e-7);
  EXPECT_NEAR(tiltOf(plate({0, 0, 0}, {0, -1, 0}, 1, 1, 0), -Vector3::UnitY()), 0.0, 1e-7);
}

// A camera that sees floor and wall, all in its own optical frame (x right, y down, z forward).
SceneContent cameraCloud(double pitch) {
  SceneContent content;
  content.trajectory.push_back(Pose::Identity());
  const Matrix3 turn = Eigen::AngleAxisd(pitch, Vector3::UnitX()).toRotationMatrix();
  for (int i = 0; i < 5; ++i) {
    content.cuboids.push_back(
        plate(turn * Vector3(0.2 * i - 0.4, 0.6, 2.0), turn * Vector3(0, -1, 0), 0.2, 1.0, 0));
    content.cuboids.push_back(
        plate(turn * Vector3(0.2 * i - 0.4, 0.2, 3.0), turn * Vector3(0, 0, -1), 0.2, 0.4, 1));
  }
  return content;
}

TEST(LooksAlongZ, TellsCamerasFromScanners) {
  for (const double pitch : {0.0, 0.3, -0.2}) EXPECT_TRUE(looksAlongZ(cameraCloud(pitch)));
  SceneContent content = testing::room();
  content.trajectory.assign(1, Pose::Identity());
  content.trajectory[0].translation() = Vector3(3.0, 2.0, 1.2);
  EXPECT_FALSE(looksAlongZ(content));
}

/// Also where all of it lies before the assumed sensor, as a camera's view does: plans and `.pgm`
/// look at the same.
TEST(SceneContent, KeepsTheUpAxisOfTheMap) {
  std::vector<float> xyz;
  for (float x = -1.0F; x < 1.0F; x += 0.02F) {
    for (float z = 2.0F; z < 4.0F; z += 0.02F) xyz.insert(xyz.end(), {x, 0.6F, z});
  }
  const std::vector<PlaneSegment> planes;
  for (const Vector3& up : {Vector3(0.0, 0.0, 1.0), Vector3(0.0, -1.0, 0.0)}) {
    FrameObservation frame;
    frame.points = PointsView(xyz.data(), xyz.size() / 3);
    frame.planes = &planes;
    PlanarMapParams params;
    params.approximation.up = up;
    PlanarMap map(params);
    map.insert(frame);
    const SceneContent content = sceneContent(map);
    ASSERT_TRUE(looksAlongZ(content));
    EXPECT_EQ(up, content.up);
  }
}

TEST(SceneContent, OfAnEmptyMapIsEmpty) {
  const SceneContent content = sceneContent(PlanarMap());
  EXPECT_TRUE(content.empty());
  EXPECT_EQ(content.up, Vector3(Vector3::UnitZ()));
}

/// A cloud in coordinates of a country was not seen from their origin.
TEST(SceneContent, TheOriginFarFromACloudIsNoSensor) {
  std::vector<float> xyz;
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 60; ++j)
      xyz.insert(xyz.end(), {0.02F * static_cast<float>(i), 0.02F * static_cast<float>(j), 284.0F});
  }
  const auto posesOf = [&](float height, bool sensor_known) {
    for (std::size_t i = 2; i < xyz.size(); i += 3) xyz[i] = height;
    const std::vector<PlaneSegment> planes;
    FrameObservation frame;
    frame.points = PointsView(xyz.data(), xyz.size() / 3);
    frame.planes = &planes;
    PlanarMapParams params;
    params.unknown_space = sensor_known;
    PlanarMap map(params);
    map.insert(frame);
    const SceneContent content = sceneContent(map);
    EXPECT_FALSE(content.cuboids.empty());
    return content.trajectory.size();
  };
  EXPECT_EQ(0u, posesOf(284.0F, false));
  EXPECT_EQ(1u, posesOf(284.0F, true));  // a sensor that looks at something far away
  EXPECT_EQ(1u, posesOf(1.0F, false));
}

}  // namespace
}  // namespace planar_mapping
