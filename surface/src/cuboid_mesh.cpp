// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/surface/cuboid_mesh.h"

#include <pcl/conversions.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <array>

namespace planar_mapping {

void writeMesh(const std::vector<Cuboid>& cuboids, pcl::PolygonMesh& mesh) {
  // Corner numbers: bit 0, 1, 2 = the far side along u, v, n.
  static constexpr std::array<std::array<unsigned, 4>, 6> kFaces = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  pcl::PointCloud<pcl::PointXYZ> vertices;
  vertices.reserve(8 * cuboids.size());
  mesh.polygons.clear();
  mesh.polygons.reserve(6 * cuboids.size());
  for (const Cuboid& cuboid : cuboids) {
    const auto first = static_cast<unsigned>(vertices.size());
    for (const Vector3& corner : corners(cuboid)) {
      const Eigen::Vector3f p = corner.cast<float>();
      vertices.push_back(pcl::PointXYZ(p.x(), p.y(), p.z()));
    }
    for (const auto& face : kFaces) {
      pcl::Vertices polygon;
      for (const unsigned corner : face)
        polygon.vertices.push_back(static_cast<pcl::index_t>(first + corner));
      mesh.polygons.push_back(std::move(polygon));
    }
  }
  vertices.header = mesh.header;
  pcl::toPCLPointCloud2(vertices, mesh.cloud);
}

}  // namespace planar_mapping
