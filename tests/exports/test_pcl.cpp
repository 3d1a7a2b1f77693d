// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// PLY and PCD, read by PCL.
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>
#include <pcl/register_point_struct.h>

#include <algorithm>

#include "export_scene.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping {
struct MapPoint {
  float x, y, z;
  std::uint32_t rgb;
  float probability;
  std::int32_t plane_id;
  std::int32_t cuboid_id;
  std::uint8_t state;
};
}  // namespace planar_mapping
POINT_CLOUD_REGISTER_POINT_STRUCT(planar_mapping::MapPoint,
                                  (float, x, x)(float, y, y)(float, z, z)(std::uint32_t, rgb, rgb)(
                                      float, probability,
                                      probability)(std::int32_t, plane_id,
                                                   plane_id)(std::int32_t, cuboid_id,
                                                             cuboid_id)(std::uint8_t, state, state))

namespace planar_mapping {
namespace {

TEST(Ply, IsReadByPcl) {
  const io::ExportedMap map = test::manyExported();
  const test::Exported file(io::writePly, map, "m.ply");
  pcl::PointCloud<pcl::PointXYZRGB> cloud;
  ASSERT_EQ(pcl::io::loadPLYFile(file.path(), cloud), 0);
  ASSERT_EQ(cloud.size(), 8 * map.cuboids.size());
  std::map<int, std::uint32_t> colours;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Cuboid& cuboid = map.cuboids[i / 8];
    const Vector3 expected = corners(cuboid)[i % 8];
    ASSERT_EQ(cloud[i].getVector3fMap(), expected.cast<float>());
    if (cuboid.state == CellState::Unknown) continue;
    const std::uint32_t colour = static_cast<std::uint32_t>(cloud[i].r) << 16u |
                                 static_cast<std::uint32_t>(cloud[i].g) << 8u | cloud[i].b;
    ASSERT_EQ(colours.emplace(cuboid.plane_id, colour).first->second, colour);
  }
  EXPECT_NE(colours.at(1), colours.at(2));
  pcl::PolygonMesh mesh;
  ASSERT_EQ(pcl::io::loadPLYFile(file.path(), mesh), 0);
  EXPECT_EQ(mesh.polygons.size(), 12 * map.cuboids.size());
}

TEST(Pcd, CentersAreReadByPcl) {
  const io::ExportedMap map = test::manyExported();
  const test::Exported file(io::writePoints, map, "m.pcd");
  pcl::PointCloud<MapPoint> cloud;
  ASSERT_EQ(pcl::io::loadPCDFile(file.path(), cloud), 0);
  ASSERT_EQ(cloud.size(), map.cuboids.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Cuboid& c = map.cuboids[i];
    const MapPoint& p = cloud[i];
    ASSERT_EQ(Eigen::Vector3f(p.x, p.y, p.z), c.center.cast<float>());
    ASSERT_EQ(p.probability, c.probability);
    ASSERT_EQ(p.plane_id, c.plane_id);
    ASSERT_EQ(p.cuboid_id, static_cast<int>(i));
    ASSERT_EQ(p.state, static_cast<std::uint8_t>(c.state));
  }
}

TEST(Pcd, SurfacePointsLieOnTheFacesAndLeaveNoGap) {
  io::ExportedMap map;
  map.cuboids = test::manyCuboids(30);
  map.options.points = io::ExportedPoints::Surface;
  map.options.spacing = 0.04;
  const test::Exported file(io::writePoints, map, "m.pcd");
  pcl::PointCloud<MapPoint> cloud;
  ASSERT_EQ(pcl::io::loadPCDFile(file.path(), cloud), 0);
  std::vector<std::vector<Vector3>> points(map.cuboids.size());
  for (const MapPoint& p : cloud)
    points.at(static_cast<std::size_t>(p.cuboid_id)).emplace_back(p.x, p.y, p.z);
  Random random(3);
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) {
    const Cuboid& c = map.cuboids[i];
    for (const Vector3& p : points[i]) {
      const Vector3 local = c.orientation.conjugate() * (p - c.center);
      EXPECT_NEAR((local.cwiseAbs() - 0.5 * c.size).maxCoeff(), 0.0, 1e-5);
    }
    for (int times = 0; times < 20; ++times) {  // any place on a face
      Vector3 local;
      for (int k = 0; k < 3; ++k) local[k] = random.uniform(-0.5, 0.5) * c.size[k];
      const int k = static_cast<int>(random.below(3));
      local[k] = (times % 2 == 0 ? 0.5 : -0.5) * c.size[k];
      double nearest = 1.0;
      for (const Vector3& p : points[i])
        nearest = std::min(nearest, (p - c.center - c.orientation * local).norm());
      EXPECT_LT(nearest, 0.029);  // half a diagonal of the spacing
    }
  }
  map.options.spacing = 1e-5;
  EXPECT_THROW(io::writePoints(map, "m.pcd"), ParameterError);
}

}  // namespace
}  // namespace planar_mapping
