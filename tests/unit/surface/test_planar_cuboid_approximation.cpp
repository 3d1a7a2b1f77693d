// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <pcl/conversions.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/surface/cuboid_mesh.h"
#include "planar_mapping/surface/planar_cuboid_approximation.h"

namespace planar_mapping {
namespace {

/// A caller's own point type: nothing but x, y, z in an order of its own.
struct OwnPoint {
  double tag = 0.0;
  float z = 0.0f;
  float y = 0.0f;
  float x = 0.0f;
};

template <typename PointT>
struct Input {
  typename pcl::PointCloud<PointT>::Ptr cloud{new pcl::PointCloud<PointT>};
  std::vector<pcl::PointIndices> inliers;
  std::vector<pcl::ModelCoefficients> planes;

  int add(float x, float y, float z) {
    PointT p;
    p.x = x;
    p.y = y;
    p.z = z;
    cloud->push_back(p);
    return static_cast<int>(cloud->size()) - 1;
  }
};

/// A wall of 2 m x 1 m at x = 2 and a block of loose points.
template <typename PointT>
Input<PointT> wallAndBlock() {
  Input<PointT> input;
  input.inliers.resize(1);
  input.planes.resize(1);
  input.planes[0].values = {2.0f, 0.0f, 0.0f, -4.0f};  // any length, either side
  for (int y = 0; y <= 40; ++y) {
    for (int z = 0; z <= 20; ++z)
      input.inliers[0].indices.push_back(input.add(2.0f, 0.05f * y, 0.05f * z));
  }
  for (int i = 0; i < 27; ++i)
    input.add(1.01f + 0.04f * (i % 3), 0.41f + 0.04f * (i / 3 % 3), 0.21f + 0.04f * (i / 9));
  return input;
}

template <typename PointT>
class PlanarCuboidApproximationTest : public ::testing::Test {};
using PointTypes = ::testing::Types<pcl::PointXYZ, pcl::PointXYZI, pcl::PointXYZL, pcl::PointXYZRGB,
                                    pcl::PointXYZRGBA, pcl::PointNormal, pcl::PointXYZRGBNormal,
                                    pcl::PointXYZINormal, OwnPoint>;
TYPED_TEST_SUITE(PlanarCuboidApproximationTest, PointTypes, );

TYPED_TEST(PlanarCuboidApproximationTest, CallsAsAPclUserWouldGuessThem) {
  const Input<TypeParam> input = wallAndBlock<TypeParam>();
  PlanarCuboidApproximation<TypeParam> approximation;
  approximation.setInputCloud(input.cloud);
  approximation.setPlanes(input.inliers, input.planes);
  approximation.setResolution(0.1);
  std::vector<Cuboid> cuboids(5);
  approximation.approximate(cuboids);
  ASSERT_GE(cuboids.size(), 2u);
  EXPECT_EQ(cuboids[0].plane_id, 0);
  EXPECT_NEAR((cuboids[0].size - Vector3(2, 1, 0.1)).norm(), 0.0, 1e-5);
  EXPECT_NEAR((cuboids[0].center - Vector3(2.05, 1, 0.5)).norm(), 0.0, 1e-5);
  for (std::size_t i = 1; i < cuboids.size(); ++i) EXPECT_EQ(cuboids[i].plane_id, -1);
  EXPECT_EQ(approximation.getDiagnostics().planes_new, 1u);
  EXPECT_EQ(approximation.getDiagnostics().dropped_points, 0u);
}

TEST(PlanarCuboidApproximation, IndicesRestrictTheCloud) {
  const auto input = wallAndBlock<pcl::PointXYZ>();
  PlanarCuboidApproximation<pcl::PointXYZ> approximation;
  approximation.setInputCloud(input.cloud);
  approximation.setPlanes(input.inliers, input.planes);
  approximation.setResolution(0.1);
  pcl::IndicesPtr lower(new pcl::Indices);
  for (int i = 0; i < static_cast<int>(input.cloud->size()); ++i) {
    if ((*input.cloud)[static_cast<std::size_t>(i)].z < 0.1f) lower->push_back(i);
  }
  approximation.setIndices(lower);
  std::vector<Cuboid> cuboids;
  approximation.approximate(cuboids);
  ASSERT_EQ(cuboids.size(), 1u);
  EXPECT_NEAR(cuboids[0].size.y(), 0.1, 1e-6);
}

TEST(PlanarCuboidApproximation, CuboidsAreInTheWorldBehindTheSurface) {
  auto input = wallAndBlock<pcl::PointXYZ>();
  input.cloud->sensor_origin_ = Eigen::Vector4f(9, 0, 0, 0);
  PlanarCuboidApproximation<pcl::PointXYZ> approximation;
  approximation.setInputCloud(input.cloud);
  approximation.setPlanes(input.inliers, input.planes);
  approximation.setThickness(0.3);
  std::vector<Cuboid> cuboids;
  approximation.approximate(cuboids);
  EXPECT_NEAR(cuboids[0].center.x(), 9.0 + 2.15, 1e-6);
  Pose pose = Pose::Identity();
  pose.translation().x() = 5.0;
  approximation.setSensorPose(pose);  // counts more than the cloud's
  approximation.approximate(cuboids);
  EXPECT_NEAR(cuboids[0].center.x(), 5.0 + 2.15, 1e-6);
}

TEST(PlanarCuboidApproximation, ACloudInMillimetresIsRefused) {
  auto input = wallAndBlock<pcl::PointXYZ>();
  for (pcl::PointXYZ& p : *input.cloud) p.getVector3fMap() *= 1000.0f;
  PlanarCuboidApproximation<pcl::PointXYZ> approximation;
  approximation.setInputCloud(input.cloud);
  std::vector<Cuboid> cuboids;
  EXPECT_THROW(approximation.approximate(cuboids), InputError);
}

TEST(PlanarCuboidApproximation, WhatCannotBeUsedIsRefused) {
  const auto input = wallAndBlock<pcl::PointXYZ>();
  PlanarCuboidApproximation<pcl::PointXYZ> a;
  std::vector<Cuboid> cuboids(3);
  EXPECT_THROW(a.approximate(cuboids), InputError);
  EXPECT_TRUE(cuboids.empty());
  pcl::PolygonMesh mesh;
  EXPECT_THROW(a.reconstruct(mesh), InputError);

  a.setInputCloud(input.cloud);
  EXPECT_THROW(a.setPlanes(input.inliers, {}), InputError);
  auto planes = input.planes;
  planes[0].values.pop_back();
  EXPECT_THROW(a.setPlanes(input.inliers, planes), InputError);
  planes[0].values = {0, 0, 0, 1};
  EXPECT_THROW(a.setPlanes(input.inliers, planes), ParameterError);
  EXPECT_TRUE(a.getPlanes().empty());

  auto inliers = input.inliers;
  inliers[0].indices.push_back(1 << 20);
  a.setPlanes(inliers, input.planes);
  EXPECT_THROW(a.approximate(cuboids), InputError);
  a.setPlanes(input.inliers, input.planes);
  a.setPointProbabilities({0.5f, 0.5f});
  EXPECT_THROW(a.approximate(cuboids), InputError);
}

TEST(PlanarCuboidApproximation, ReconstructGivesTheBoxesAsAMesh) {
  auto input = wallAndBlock<pcl::PointXYZ>();
  input.cloud->header.frame_id = "map";
  PlanarCuboidApproximation<pcl::PointXYZ> a;
  a.setInputCloud(input.cloud);
  a.setPlanes(input.inliers, input.planes);
  std::vector<Cuboid> cuboids;
  a.approximate(cuboids);
  pcl::PolygonMesh mesh;
  pcl::PCLSurfaceBase<pcl::PointXYZ>& base = a;
  base.reconstruct(mesh);
  EXPECT_EQ(mesh.header.frame_id, "map");
  EXPECT_EQ(mesh.polygons.size(), 6 * cuboids.size());
  EXPECT_EQ(mesh.cloud.width, 8 * cuboids.size());
}

TEST(CuboidMesh, FacesLookOutwardsAndEncloseTheVolume) {
  Cuboid cuboid;
  cuboid.center = {1, 2, 3};
  cuboid.size = {0.5, 1.0, 2.0};
  cuboid.orientation = Eigen::AngleAxisd(0.8, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  pcl::PolygonMesh mesh;
  writeMesh({cuboid, Cuboid()}, mesh);
  ASSERT_EQ(mesh.polygons.size(), 12u);
  pcl::PointCloud<pcl::PointXYZ> vertices;
  pcl::fromPCLPointCloud2(mesh.cloud, vertices);
  ASSERT_EQ(vertices.size(), 16u);
  double volume = 0.0;
  for (std::size_t f = 0; f < 6; ++f) {
    const auto& corner = mesh.polygons[f].vertices;
    ASSERT_EQ(corner.size(), 4u);
    const auto at = [&](std::size_t k) -> Vector3 {
      return vertices[static_cast<std::size_t>(corner[k])].getVector3fMap().cast<double>() -
             cuboid.center;
    };
    EXPECT_GT((at(1) - at(0)).cross(at(2) - at(1)).dot(at(0) + at(2)), 0.0);
    // Divergence theorem over the two triangles of the face.
    volume += at(0).dot(at(1).cross(at(2))) / 6.0 + at(0).dot(at(2).cross(at(3))) / 6.0;
  }
  EXPECT_NEAR(volume, 1.0, 1e-5);
}

TEST(CuboidMesh, NothingGivesAnEmptyMesh) {
  pcl::PolygonMesh mesh;
  mesh.polygons.resize(3);
  writeMesh({}, mesh);
  EXPECT_TRUE(mesh.polygons.empty());
  EXPECT_EQ(mesh.cloud.width * mesh.cloud.height, 0u);
}

}  // namespace
}  // namespace planar_mapping
