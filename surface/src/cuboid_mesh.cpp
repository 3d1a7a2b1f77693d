// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/surface/cuboid_mesh.h"

#include <pcl/conversions.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace planar_mapping {

void writeMesh(const std::vector<Cuboid>& cuboids, pcl::PolygonMesh& mesh) {
  pcl::PointCloud<pcl::PointXYZ> vertices;
  vertices.reserve(8 * cuboids.size());
  mesh.polygons.clear();
  mesh.polygons.reserve(6 * cuboids.size());
  for (const Cuboid& cuboid : cuboids) {
    const auto first = static_cast<pcl::index_t>(vertices.size());
    for (const Vector3& corner : corners(cuboid)) {
      const Eigen::Vector3f p = corner.cast<float>();
      vertices.push_back(pcl::PointXYZ(p.x(), p.y(), p.z()));
    }
    for (const auto& face : kCuboidFaces) {
      pcl::Vertices polygon;
      for (const int corner : face) polygon.vertices.push_back(first + corner);
      mesh.polygons.push_back(std::move(polygon));
    }
  }
  vertices.header = mesh.header;
  pcl::toPCLPointCloud2(vertices, mesh.cloud);
}

}  // namespace planar_mapping
