// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <tuple>
#include <utility>

#include "planar_mapping/cuboids/compact_cover.h"
#include "planar_mapping/cuboids/plane_cover.h"
#include "planar_mapping/geometry/plane_moments.h"
#include "planar_mapping/grid/cell_table.h"

namespace planar_mapping {
namespace {

/// On the fitted plane of a cluster.
PlaneFrame frameOf(const std::vector<const NonPlanarCell*>& cluster,
                   const CuboidApproximationParams& params, const Vector3& sensor) {
  PlaneMoments moments;
  for (const NonPlanarCell* cell : cluster) moments.add(cell->mean);
  const PlaneMoments::Fit fit = moments.fit();
  // One cell, or cells in a row: they have no plane of their own and face the sensor.
  Plane plane = fit.plane;
  if (!fit.valid) {
    Vector3 towards = sensor - moments.mean();
    if (!(towards.norm() > 1e-9)) towards = params.up;
    plane.normal = towards.normalized();
    plane.offset = -plane.normal.dot(moments.mean());
  }
  return makePlaneFrame(orientedTowards(plane, sensor), moments.mean(), params.up);
}

/// Quarters a cluster in its view, as splitAndMerge() does with a patch, but on the list of cells:
/// a long diagonal cluster would make a huge raster. [ours] A unit is also split while its cells
/// are not within one thickness of each other along the normal, so that no leaf reaches out in
/// front of the surface it stands for.
class ClusterSplitter {
 public:
  ClusterSplitter(const std::vector<const NonPlanarCell*>& cluster,
                  const CuboidApproximationParams& params, const Vector3& sensor)
      : cluster_(cluster),
        params_(params),
        frame_(frameOf(cluster, params, sensor)),
        thickness_(detail::thicknessOf(params)),
        min_width_(detail::lengthInCells(params.min_width, params.resolution)),
        min_height_(detail::lengthInCells(params.min_height, params.resolution)) {
    for (const NonPlanarCell* cell : cluster) local_.push_back(frame_.toPlane(cell->mean));
  }

  std::vector<Cuboid> run() {
    low_ = local_.front().head<2>();
    Vector2 high = low_;
    std::vector<std::size_t> all(cluster_.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i] = i;
      low_ = low_.cwiseMin(local_[i].head<2>());
      high = high.cwiseMax(local_[i].head<2>());
    }
    const Vector2 extent = (high - low_) / params_.resolution;
    // Half a cell around the outermost means: the points reach beyond them.
    low_.array() -= 0.5 * params_.resolution;
    split({0, 0, static_cast<std::int32_t>(std::ceil(extent.x())) + 1,
           static_cast<std::int32_t>(std::ceil(extent.y())) + 1},
          std::move(all));
    return std::move(cuboids_);
  }

 private:
  std::pair<std::int32_t, std::int32_t> cellOf(std::size_t i) const {
    const Vector2 p = (local_[i].head<2>() - low_) / params_.resolution;
    return {static_cast<std::int32_t>(std::floor(p.x())),
            static_cast<std::int32_t>(std::floor(p.y()))};
  }

  void split(const CellRectangle& unit, std::vector<std::size_t> members) {
    if (members.empty()) return;
    if (!splits(unit, members)) {
      addLeaves(unit, std::move(members));
      return;
    }
    const std::int32_t w = unit.width / 2;
    const std::int32_t h = unit.height / 2;
    std::array<std::vector<std::size_t>, 4> parts;
    for (const std::size_t i : members) {
      const auto [a, b] = cellOf(i);
      parts[(a >= unit.a + w ? 1u : 0u) + (b >= unit.b + h ? 2u : 0u)].push_back(i);
    }
    members = {};
    split({unit.a, unit.b, w, h}, std::move(parts[0]));
    split({unit.a + w, unit.b, unit.width - w, h}, std::move(parts[1]));
    split({unit.a, unit.b + h, w, unit.height - h}, std::move(parts[2]));
    split({unit.a + w, unit.b + h, unit.width - w, unit.height - h}, std::move(parts[3]));
  }

  bool splits(const CellRectangle& unit, const std::vector<std::size_t>& members) const {
    if (unit.width <= min_width_ || unit.height <= min_height_) return false;
    double low = local_[members.front()].z();
    double high = low;
    std::vector<std::pair<std::int32_t, std::int32_t>> occupied;
    occupied.reserve(members.size());
    for (const std::size_t i : members) {
      low = std::min(low, local_[i].z());
      high = std::max(high, local_[i].z());
      occupied.push_back(cellOf(i));
    }
    if (high - low > thickness_) return true;
    std::sort(occupied.begin(), occupied.end());
    const auto last = std::unique(occupied.begin(), occupied.end());
    const auto count = static_cast<double>(std::distance(occupied.begin(), last));
    return count / static_cast<double>(unit.area()) < params_.density_threshold;
  }

  /// Usually one leaf; cells that lie behind each other with a gap between give one leaf each.
  void addLeaves(const CellRectangle& unit, std::vector<std::size_t> members) {
    std::sort(members.begin(), members.end(), [&](std::size_t l, std::size_t r) {
      return std::make_tuple(-local_[l].z(), l) < std::make_tuple(-local_[r].z(), r);
    });
    std::size_t first = 0;
    while (first < members.size()) {
      const double front = local_[members[first]].z();
      double back = front;
      double probability = 0.0;
      std::size_t next = first;
      for (; next < members.size(); ++next) {
        const double height = local_[members[next]].z();
        if (back - height > 2.0 * thickness_) break;
        back = height;
        probability += cluster_[members[next]]->probability;
      }
      addLeaf(unit, front, std::max(front - back, thickness_),
              probability / static_cast<double>(next - first));
      first = next;
    }
  }

  void addLeaf(const CellRectangle& unit, double front, double depth, double probability) {
    const double s = params_.resolution;
    Matrix3 axes;
    axes << frame_.u, frame_.v, frame_.n;
    Cuboid cuboid;
    cuboid.size = {unit.width * s, unit.height * s, depth};
    cuboid.center =
        frame_.fromPlane({low_.x() + (unit.a + 0.5 * unit.width) * s,
                          low_.y() + (unit.b + 0.5 * unit.height) * s, front - 0.5 * depth});
    cuboid.orientation = Quaternion(axes);
    cuboid.probability = static_cast<float>(probability);
    cuboids_.push_back(cuboid);
  }

  const std::vector<const NonPlanarCell*>& cluster_;
  const CuboidApproximationParams& params_;
  const PlaneFrame frame_;
  std::vector<Vector3> local_;  ///< cell means in the frame
  const double thickness_;
  const int min_width_;
  const int min_height_;
  Vector2 low_;
  std::vector<Cuboid> cuboids_;
};

}  // namespace

std::vector<Cuboid> cuboidsOfCells(std::vector<NonPlanarCell> cells,
                                   const CuboidApproximationParams& params, const Vector3& sensor) {
  params.validate();
  std::sort(cells.begin(), cells.end(), [](const NonPlanarCell& l, const NonPlanarCell& r) {
    return std::tie(l.z, l.y, l.x) < std::tie(r.z, r.y, r.x);
  });
  // Across faces, edges and corners.
  detail::CellTable table(cells.size());
  for (const NonPlanarCell& cell : cells) table.insert({cell.x, cell.y, cell.z});
  const std::vector<std::int32_t> component = detail::componentsOf(table, {1, 1, 1});
  std::vector<std::vector<const NonPlanarCell*>> clusters;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto cluster = static_cast<std::size_t>(component[i]);
    if (cluster >= clusters.size()) clusters.resize(cluster + 1);
    clusters[cluster].push_back(&cells[i]);
  }
  std::vector<Cuboid> cuboids;
  for (const std::vector<const NonPlanarCell*>& cluster : clusters) {
    const std::vector<Cuboid> leaves = ClusterSplitter(cluster, params, sensor).run();
    cuboids.insert(cuboids.end(), leaves.begin(), leaves.end());
  }
  return cuboids;
}

}  // namespace planar_mapping
