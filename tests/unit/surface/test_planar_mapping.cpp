// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/surface/planar_mapping.h"

#include <gtest/gtest.h>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

/// A wall x = 2 of 2 m x 1 m, in the sensor's frame.
struct Wall {
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud{new pcl::PointCloud<pcl::PointXYZ>};
  std::vector<PlaneSegment> planes = std::vector<PlaneSegment>(1);

  explicit Wall(float scale = 1.0f) {
    planes[0].plane = planeFromCoefficients(-1.0, 0.0, 0.0, 2.0 * static_cast<double>(scale));
    for (int y = 0; y < 80; ++y) {
      for (int z = 0; z < 40; ++z) {
        planes[0].inliers.push_back(static_cast<int>(cloud->size()));
        cloud->push_back(
            {scale * 2.0f, scale * (0.025f * y + 0.0125f), scale * (0.025f * z + 0.0125f)});
      }
    }
  }
};

Pose shifted(double y) {
  Pose pose = Pose::Identity();
  pose.translation().y() = y;
  return pose;
}

using Mapping = PlanarMapping<pcl::PointXYZ>;

TEST(PlanarMapping, ManyFramesExtendOneMap) {
  const Wall wall;
  Mapping mapping;
  mapping.setInputCloud(wall.cloud);
  mapping.setPlanes(wall.planes);
  mapping.setSensorPose(shifted(0.0));
  EXPECT_EQ(mapping.integrate().planes_new, 1u);
  const std::vector<Cuboid> one = mapping.map().cuboids();
  ASSERT_EQ(one.size(), 1u);
  EXPECT_NEAR(one[0].size.x() * one[0].size.y(), 2.0, 1e-6);
  mapping.setSensorPose(shifted(1.0));
  EXPECT_EQ(mapping.integrate().planes_matched, 1u);
  EXPECT_EQ(mapping.getDiagnostics().planes_matched, 1u);
  EXPECT_EQ(mapping.map().frames(), 2u);
  const std::vector<Cuboid>& two = mapping.map().cuboids();
  ASSERT_EQ(two.size(), 1u);
  EXPECT_NEAR(two[0].size.x() * two[0].size.y(), 3.0, 1e-6);
}

TEST(PlanarMapping, ParametersHoldFromTheNextReset) {
  const Wall wall;
  Mapping mapping;
  mapping.setResolution(0.2);
  mapping.setInputCloud(wall.cloud);
  mapping.integrate();
  EXPECT_EQ(mapping.map().params().approximation.resolution, 0.2);
  mapping.setResolution(0.1);
  mapping.integrate();
  EXPECT_EQ(mapping.map().params().approximation.resolution, 0.2);
  EXPECT_EQ(mapping.map().frames(), 2u);
  mapping.reset();
  EXPECT_EQ(mapping.map().frames(), 0u);
  mapping.integrate();
  EXPECT_EQ(mapping.map().params().approximation.resolution, 0.1);
  EXPECT_EQ(mapping.map().frames(), 1u);
}

TEST(PlanarMapping, WorksOnTheMapOfACaller) {
  const Wall wall;
  PlanarMap map;
  Mapping mapping;
  mapping.setMap(map);
  mapping.setInputCloud(wall.cloud);
  mapping.integrate();
  EXPECT_EQ(map.frames(), 1u);
  EXPECT_EQ(&mapping.map(), &map);
  mapping.reset();
  EXPECT_EQ(map.frames(), 1u);
  EXPECT_EQ(mapping.map().frames(), 0u);
}

TEST(PlanarMapping, CopiesHaveMapsOfTheirOwn) {
  const Wall wall;
  Mapping mapping;
  mapping.setInputCloud(wall.cloud);
  mapping.integrate();
  Mapping copy = mapping;
  copy.integrate();
  EXPECT_EQ(mapping.map().frames(), 1u);
  EXPECT_EQ(copy.map().frames(), 2u);
}

TEST(PlanarMapping, StampsAndPosesAreInTheTrajectory) {
  const Wall wall;
  wall.cloud->header.stamp = 2500000;
  Mapping mapping;
  mapping.setInputCloud(wall.cloud);
  mapping.setSensorPose(shifted(1.0));
  mapping.integrate();
  mapping.setTimestamp(4.25);
  mapping.integrate();
  const auto& trajectory = mapping.map().trajectory();
  ASSERT_EQ(trajectory.size(), 2u);
  EXPECT_EQ(trajectory[0].first, 2.5);
  EXPECT_EQ(trajectory[1].first, 4.25);
  EXPECT_NEAR(trajectory[0].second.translation().y(), 1.0, 1e-9);
}

TEST(PlanarMapping, GroundClearsSpaceAndMakesNoCuboid) {
  const Wall wall;
  Mapping mapping;
  mapping.setInputCloud(wall.cloud);
  mapping.setGroundIndices(wall.planes[0].inliers);
  mapping.integrate();
  EXPECT_TRUE(mapping.map().cuboids().empty());
  EXPECT_TRUE(mapping.map().isFree({1.0, 0.5, 0.25}));
}

TEST(PlanarMapping, WhatCannotBeUsedIsRefused) {
  const Wall wall;
  Mapping mapping;
  EXPECT_THROW(mapping.integrate(), InputError);
  mapping.setInputCloud(wall.cloud);
  Pose mirrored = Pose::Identity();
  mirrored.linear() = -Matrix3::Identity();
  mapping.setSensorPose(mirrored);
  EXPECT_THROW(mapping.integrate(), InputError);
  mapping.setSensorPose(std::nullopt);
  mapping.setPointProbabilities({0.5f});
  EXPECT_THROW(mapping.integrate(), InputError);
  EXPECT_EQ(mapping.map().frames(), 0u);
}

/// Two walls, one behind the other, cannot both have been seen from the origin.
TEST(PlanarMapping, APoseInCoordinatesOfACountryIsRefused) {
  const Wall wall;
  Mapping mapping;
  mapping.setResolution(0.1);
  mapping.setInputCloud(wall.cloud);
  mapping.setPlanes(wall.planes);
  mapping.setSensorPose(shifted(104000.0));
  EXPECT_EQ(mapping.integrate().planes_new, 1u);
  mapping.setSensorPose(shifted(5412000.0));  // its space and its non-planar points have no cells
  EXPECT_THROW(mapping.integrate(), InputError);
}

TEST(PlanarMapping, AMergedCloudWithoutAPoseKnowsNoFreeSpace) {
  const Wall wall;
  const auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*wall.cloud);
  for (const pcl::PointXYZ& p : *wall.cloud) cloud->push_back({2.0f * p.x, 2.0f * p.y, 2.0f * p.z});
  const auto stateBefore = [&](const std::optional<Pose>& pose) {
    Mapping mapping;
    mapping.setInputCloud(cloud);
    mapping.setSensorPose(pose);
    EXPECT_EQ(mapping.integrate().merged_cloud, !pose.has_value());
    return mapping.map().stateAt(Vector3(1.0, 0.5, 0.25));
  };
  EXPECT_EQ(stateBefore(std::nullopt), CellState::Unknown);
  EXPECT_EQ(stateBefore(Pose::Identity()), CellState::Free) << "the caller says where it was";
}

TEST(PlanarMapping, PlanesOfTheCloudBeforeAreRefused) {
  const Wall wall;
  Mapping mapping;
  mapping.setPlanes(wall.planes);
  const auto farther = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*wall.cloud);
  for (pcl::PointXYZ& p : *farther) p.x += 0.6f;
  mapping.setInputCloud(farther);
  EXPECT_THROW(mapping.integrate(), InputError);
  mapping.setInputCloud(wall.cloud);
  EXPECT_EQ(mapping.integrate().planes_new, 1u);
}

TEST(PlanarMapping, ACloudInMillimetresIsRefused) {
  const Wall wall(1000.0f);
  Mapping mapping;
  mapping.setInputCloud(wall.cloud);
  mapping.setPlanes(wall.planes);
  EXPECT_THROW(mapping.integrate(), InputError);
  PlanarMapParams params;
  params.approximation.resolution = 100.0;
  params.association_offset = 100.0;
  params.max_range = 1e4;
  mapping.setParams(params);
  mapping.integrate();
  EXPECT_EQ(mapping.map().cuboids().size(), 1u);
}

}  // namespace
}  // namespace planar_mapping
