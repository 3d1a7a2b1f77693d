// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/filters/ground_removal.h"

#include <gtest/gtest.h>

#include "ground_scene.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

pcl::PointCloud<pcl::PointXYZ>::Ptr cloudOf(const std::vector<float>& xyz, int width, int height) {
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (std::size_t i = 0; i < xyz.size(); i += 3)
    cloud->push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
  cloud->width = static_cast<std::uint32_t>(width);
  cloud->height = static_cast<std::uint32_t>(height);
  cloud->is_dense = false;
  return cloud;
}

/// What stays of a rendered scene.
pcl::Indices filtered(GroundRemoval<pcl::PointXYZ>& removal, const test::GroundScene& scene) {
  removal.setInputCloud(cloudOf(scene.xyz, scene.width, scene.height));
  pcl::Indices kept;
  removal.filter(kept);
  return kept;
}

TEST(GroundRemoval, ReturnsWhatStandsOnTheGround) {
  test::GroundScene scene;
  scene.wall_distance = 2.5;
  scene.pitch = 0.1;
  scene.render();
  GroundRemoval<pcl::PointXYZ> removal;
  const pcl::Indices kept = filtered(removal, scene);
  std::size_t wall = 0;
  for (const int i : kept) wall += scene.truth[i] == 2;
  EXPECT_GT(static_cast<double>(wall) / static_cast<double>(kept.size()), 0.98);

  removal.setNegative(true);
  const pcl::Indices ground = filtered(removal, scene);
  std::size_t floor = 0;
  for (const int i : ground) floor += scene.truth[i] == 1;
  EXPECT_GT(static_cast<double>(floor) / static_cast<double>(ground.size()), 0.98);
}

TEST(GroundRemoval, GivesThePlaneAndItsCovariance) {
  test::GroundScene scene;
  scene.disparity_noise = 0.1;
  scene.render();
  GroundRemoval<pcl::PointXYZ> removal;
  filtered(removal, scene);
  Vector4 plane;
  Matrix4 covariance;
  removal.getGroundPlane(plane, covariance);
  EXPECT_NEAR(plane[1], -1.0, 0.01);
  EXPECT_NEAR(plane[3], 0.37, 0.01);
  EXPECT_GT(covariance(3, 3), 0.0);
  EXPECT_EQ(removal.getDiagnostics().status, GroundStatus::Found);
}

TEST(GroundRemoval, FindsTheGroundAtAnyHeight) {
  for (const double height : {0.37, 1.5, 2.8}) {
    test::GroundScene scene;
    scene.camera_height = height;
    scene.pitch = 0.2;
    scene.render();
    GroundRemoval<pcl::PointXYZ> removal;
    filtered(removal, scene);
    EXPECT_NEAR(removal.getGround().height, height, 0.02);
  }
}

TEST(GroundRemoval, RemovesNothingWithoutGroundAndSaysSo) {
  test::GroundScene scene;
  scene.camera_height = 1.5;
  scene.pitch = 0.2;
  scene.render();
  GroundRemoval<pcl::PointXYZ> removal;
  removal.setCameraHeight(0.37);  // far from the truth
  const pcl::Indices kept = filtered(removal, scene);
  std::size_t finite = 0;
  for (const int what : scene.truth) finite += what != 0;
  EXPECT_EQ(kept.size(), finite);
  EXPECT_NE(removal.getDiagnostics().status, GroundStatus::Found);
  Vector4 plane;
  Matrix4 covariance;
  removal.getGroundPlane(plane, covariance);
  EXPECT_TRUE(plane.isZero(0.0));
  EXPECT_TRUE(covariance.isZero(0.0));
}

TEST(GroundRemoval, TakesThePoseThatIsGivenElseThatOfTheCloud) {
  // A camera that looks 40 degrees down: only its pose says where up is.
  test::GroundScene scene;
  scene.camera_height = 1.2;
  scene.pitch = 0.7;
  scene.render();
  const auto cloud = cloudOf(scene.xyz, scene.width, scene.height);
  GroundRemoval<pcl::PointXYZ> removal;
  removal.setUpAxis(Vector3::UnitZ());
  removal.setInputCloud(cloud);
  pcl::Indices kept;
  removal.filter(kept);
  EXPECT_FALSE(removal.getGround().found);

  Pose pose = Pose::Identity();
  pose.linear() = scene.levelFromCamera();
  removal.setSensorPose(pose);
  removal.filter(kept);
  ASSERT_TRUE(removal.getGround().found);
  EXPECT_NEAR(removal.getGround().height, 1.2, 0.02);

  removal.setSensorPose(std::nullopt);
  removal.reset();
  cloud->sensor_orientation_ = Eigen::Quaterniond(Matrix3(pose.linear())).cast<float>();
  removal.filter(kept);
  EXPECT_TRUE(removal.getGround().found);
  cloud->sensor_orientation_ = Eigen::Quaternionf(0.0f, 0.0f, 0.0f, 0.0f);
  EXPECT_THROW(removal.filter(kept), InputError);
}

TEST(GroundRemoval, RefusesMillimetres) {
  test::GroundScene scene;
  scene.render();
  for (float& coordinate : scene.xyz) coordinate *= 1000.0f;
  GroundRemoval<pcl::PointXYZ> removal;
  removal.setInputCloud(cloudOf(scene.xyz, scene.width, scene.height));
  pcl::Indices kept;
  EXPECT_THROW(removal.filter(kept), InputError);
}

}  // namespace
}  // namespace planar_mapping
