// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/surface/cuboid_mesh.h"

#include <gtest/gtest.h>
#include <pcl/conversions.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace planar_mapping {
namespace {

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
