// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "numbers.h"
#include "patch_scene.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/surface/planar_mapping.h"

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
  EXPECT_EQ(mapping.map().params().association_offset, 0.2);
  EXPECT_EQ(mapping.map().params().association_gap, 1.0);
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

TEST(PlanarMapping, ACloudInTheWorldIsSeenFromTheOriginOfItsSensor) {
  const Vector3 origin(1.5, -2.25, 0.5);
  const Wall wall;
  Mapping posed;
  posed.setInputCloud(wall.cloud);
  posed.setPlanes(wall.planes);
  posed.setSensorPose(Pose(Eigen::Translation3d(origin)));
  posed.integrate();
  auto world = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*wall.cloud);
  for (pcl::PointXYZ& point : *world) point.getVector3fMap() += origin.cast<float>();
  std::vector<PlaneSegment> planes = wall.planes;
  // As a search finds it whose normals point to (0, 0, 0), on the far side of the sensor or not.
  planes[0].plane = transformed(planes[0].plane, Pose(Eigen::Translation3d(origin))).flipped();
  Mapping mapping;
  mapping.setInputCloud(world);
  mapping.setPlanes(planes);
  mapping.setSensorOrigin(origin);
  EXPECT_EQ(mapping.integrate().planes_new, 1u);
  ASSERT_EQ(mapping.map().cuboidCount(), posed.map().cuboidCount());
  EXPECT_LT((mapping.map().cuboids()[0].center - posed.map().cuboids()[0].center).norm(), 1e-6);
  EXPECT_EQ(mapping.map().stateAt(origin + Vector3(1.0, 0.5, 0.2)), CellState::Free);
  EXPECT_EQ(mapping.map().stateAt(origin + Vector3(2.5, 1.5, 0.5)), CellState::Unknown);
  EXPECT_EQ(mapping.map().trajectory()[0].second.translation(), origin);
  mapping.setSensorPose(Pose::Identity());
  EXPECT_THROW(mapping.integrate(), InputError);
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

// Cuboids of one frame: what PlanarCuboidApproximation gives.

using namespace test;
using Scene = test::PatchScene;

double coverage(const Scene& scene, const std::vector<Cuboid>& cuboids, double margin) {
  std::size_t inside = 0;
  const PointsView points = scene.view();
  for (std::size_t i = 0; i < points.size; ++i) {
    inside += std::any_of(cuboids.begin(), cuboids.end(),
                          [&](const Cuboid& c) { return contains(c, points.point(i), margin); });
  }
  return static_cast<double>(inside) / static_cast<double>(points.size);
}

TEST(OneFrame, WallBecomesOneCuboidBehindItsSurface) {
  Scene scene;
  PlaneSegment wall;
  wall.plane = planeFromCoefficients(1, 0, 0, -2);  // turned towards the sensor by us
  for (int y = 0; y <= 40; ++y) {
    for (int z = 0; z <= 20; ++z) wall.inliers.push_back(scene.add({2, 0.05 * y, 0.05 * z}));
  }
  scene.planes.push_back(wall);
  for (const Profile profile : {Profile::Paper, Profile::Compact}) {
    PlanarMapParams params = paramsFor(profile);
    params.approximation.thickness = 0.25;
    const auto cuboids = cuboidsOf(scene, params);
    ASSERT_EQ(cuboids.size(), 1u);
    EXPECT_NEAR((cuboids[0].center - Vector3(2.125, 1.0, 0.5)).norm(), 0.0, 1e-6);
    EXPECT_NEAR((cuboids[0].size - Vector3(2.0, 1.0, 0.25)).norm(), 0.0, 1e-6);
    EXPECT_TRUE((cuboids[0].orientation * Vector3::UnitZ()).isApprox(Vector3(-1, 0, 0), 1e-9));
    EXPECT_EQ(cuboids[0].plane_id, 0);
    EXPECT_FALSE(contains(cuboids[0], {1.99, 1.0, 0.5}));
  }
}

TEST(OneFrame, EveryPointIsInsideOrWithinHalfACell) {
  const Scene scene = room();
  for (const double s : {0.05, 0.1, 0.3}) {
    const auto compact = cuboidsOf(scene, paramsFor(Profile::Compact, s));
    EXPECT_EQ(coverage(scene, compact, 0.5 * s + 1e-6), 1.0) << s;
    const auto paper = cuboidsOf(scene, paramsFor(Profile::Paper, s));
    EXPECT_GT(coverage(scene, paper, 0.5 * s + 1e-6), 0.99) << s;
    EXPECT_LT(compact.size(), paper.size());
  }
}

TEST(OneFrame, PointsAtAPlaneAreAbsorbedAndIsolatedNoiseIsDropped) {
  Random random(2);
  Scene scene;
  scene.addPatch(random, {2, 0, 0}, {0, 1, 0}, {0, 0, 1}, 5000, 0.0);
  scene.add({1.96, 0.5, 0.5});   // within half a cell of the wall
  scene.add({1.0, 0.52, 0.52});  // alone in the air
  FrameUpdate d;
  PlanarMapParams params = paramsFor(Profile::Compact);
  params.min_cell_fraction = 0.0;  // one point is enough
  EXPECT_EQ(cuboidsOf(scene, params, {Pose::Identity(), nullptr, nullptr, &d}).size(), 2u);
  EXPECT_EQ(d.absorbed_points, 1u);
  params.approximation.min_points_per_cell = 2;
  EXPECT_EQ(cuboidsOf(scene, params, {Pose::Identity(), nullptr, nullptr, &d}).size(), 1u);
  EXPECT_EQ(d.dropped_points, 1u);
  params.approximation.profile = Profile::Paper;
  params.approximation.min_points_per_cell = 1;
  EXPECT_EQ(cuboidsOf(scene, params).size(), 3u);
}

TEST(OneFrame, SmallHolesAreFilledAndLargeOnesStayOpen) {
  Scene scene;
  PlaneSegment wall;
  wall.plane = planeFromCoefficients(-1, 0, 0, 2);
  for (int y = 0; y < 120; ++y) {
    for (int z = 0; z < 80; ++z) {
      const bool small = y / 4 == 5 && z / 4 == 5;
      const bool large = y / 4 >= 12 && y / 4 < 16 && z / 4 >= 8 && z / 4 < 12;
      if (small || large) continue;
      wall.inliers.push_back(scene.add({2, 0.025 * y + 0.0125, 0.025 * z + 0.0125}));
    }
  }
  scene.planes.push_back(wall);
  PlanarMapParams params = paramsFor(Profile::Compact);
  const Vector3 in_small(2.01, 0.55, 0.55), in_large(2.01, 1.4, 1.0);
  const auto holds = [&](const Vector3& p) {
    const auto cuboids = cuboidsOf(scene, params);
    return std::any_of(cuboids.begin(), cuboids.end(),
                       [&](const Cuboid& c) { return contains(c, p); });
  };
  EXPECT_TRUE(holds(in_small));
  EXPECT_FALSE(holds(in_large));
  params.approximation.hole_size = 0.01;  // less than a cell: off
  EXPECT_FALSE(holds(in_small));
  params.approximation.hole_size = 0.5;
  EXPECT_TRUE(holds(in_large));
}

TEST(OneFrame, BeliefIsTheMeanOverCellsOfTheMeanOverPoints) {
  Scene scene;
  PlaneSegment wall;
  wall.plane = planeFromCoefficients(-1, 0, 0, 2);
  std::vector<float> belief;
  const auto addPoint = [&](double y, double z, float p) {
    wall.inliers.push_back(scene.add({2, y, z}));
    belief.push_back(p);
  };
  addPoint(0.00, 0.00, 0.2f);  // first cell: mean 0.3
  addPoint(0.05, 0.05, 0.4f);
  addPoint(0.20, 0.10, 0.9f);  // second cell
  scene.planes.push_back(wall);
  PlanarMapParams params = paramsFor(Profile::Compact);
  params.approximation.rectangle_cells = 0.0;
  params.min_cell_fraction = 0.0;
  params.min_probability = 0.0;
  const auto cuboids = cuboidsOf(scene, params, {Pose::Identity(), nullptr, &belief, nullptr});
  constexpr double kBeliefStep = 1.0 / 17.0;  // of the beliefs that a map keeps
  ASSERT_EQ(cuboids.size(), 1u);
  EXPECT_EQ(cuboids[0].plane_id, 0);
  EXPECT_NEAR(cuboids[0].probability, 0.6, 0.5 * kBeliefStep);
}

TEST(OneFrame, HostileCloudsGiveSmallAnswers) {
  const PlanarMapParams compact = paramsFor(Profile::Compact, 0.05);
  const PlanarMapParams paper = paramsFor(Profile::Paper, 0.05);
  EXPECT_TRUE(cuboidsOf(Scene(), compact).empty());

  Scene scene;
  PlaneSegment plane;
  plane.plane = planeFromCoefficients(0, 0, 1, -1);
  for (const double far : {0.0, 1e3, 1e9, -1e9, 3e38}) {
    plane.inliers.push_back(scene.add({far, 1, 1}));
    plane.inliers.push_back(scene.add({far, -far, 1}));
    scene.add({far, 2, far});
  }
  for (int i = 0; i < 50; ++i) plane.inliers.push_back(scene.add({0.01 * i, 5, 1}));  // a line
  for (int i = 0; i < 50; ++i) plane.inliers.push_back(scene.add({7, 7, 1}));         // one place
  for (const float bad : {test::kNanFloat, std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity()}) {
    for (int axis = 0; axis < 3; ++axis) {
      Vector3 p(0.1, 0.2, 1);
      p[axis] = static_cast<double>(bad);
      plane.inliers.push_back(scene.add(p));
      scene.add(p);
    }
  }
  for (int side = 0; side < 2; ++side) {
    scene.planes.assign(static_cast<std::size_t>(side), plane);
    for (const PlanarMapParams& params : {compact, paper}) {
      FrameUpdate d;
      const auto cuboids = cuboidsOf(scene, params, {Pose::Identity(), nullptr, nullptr, &d});
      EXPECT_FALSE(cuboids.empty());
      EXPECT_LT(cuboids.size(), 60u);
      EXPECT_GE(d.dropped_points, 18u);
      for (const Cuboid& c : cuboids) {
        EXPECT_TRUE(c.center.allFinite() && c.size.allFinite());
        EXPECT_NEAR(c.orientation.norm(), 1.0, 1e-9);
      }
    }
  }
}

TEST(OneFrame, WideThinPlanesNeedLittleMemory) {
  // A diagonal line of 20 km: as a dense raster it would take 10^10 cells.
  Scene scene;
  PlaneSegment plane;
  plane.plane = planeFromCoefficients(0, 0, 1, -1);
  for (int i = 0; i < 4000; ++i) plane.inliers.push_back(scene.add({5.0 * i, 5.0 * i, 1}));
  for (int i = 0; i < 4000; ++i) plane.inliers.push_back(scene.add({0.02 * i, -0.02 * i, 1}));
  scene.planes.push_back(plane);
  for (const Profile profile : {Profile::Paper, Profile::Compact}) {
    const auto cuboids = cuboidsOf(scene, paramsFor(profile));
    EXPECT_GT(cuboids.size(), 4000u);
    EXPECT_LT(cuboids.size(), 6000u);
  }
}

}  // namespace
}  // namespace planar_mapping
