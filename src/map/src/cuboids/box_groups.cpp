// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/box_groups.h"

#include <algorithm>
#include <map>
#include <utility>

#include "cuboids/cover_geometry.h"
#include "planar_mapping/core/base/detail/disjoint_parts.h"

namespace planar_mapping::detail {
namespace {

/// Half cells between boxes that may have to do with each other: a half cell that boxes may stand
/// for lies at most one beside each, and they may be made of half cells at most two apart.
constexpr std::int32_t kMaxGap = 4;
/// Half cells between boxes of which one stands for what is beside the other.
constexpr std::int32_t kNear = 2;
/// More, or farther apart, are covered anew face by face: a group takes time as a whole, and a grid
/// around it memory.
constexpr std::size_t kMaxBoxes = 16384;
constexpr double kMaxVolume = 1 << 26;  ///< half cells
/// So many around a group have to do with it at most, on both sides together.
constexpr std::int32_t kAround = 24;
/// Boxes are looked up in cubes of 2^5 half cells.
constexpr int kCubeBits = 5;

/// In half cells.
Eigen::AlignedBox3i extentOf(const Cuboid& box, double half_cell) {
  const Eigen::AlignedBox3d bounds = boundsOf(box, 0.0);
  const auto at = [&](const Vector3& corner) -> Eigen::Vector3i {
    return (corner / half_cell).array().round().cast<int>();
  };
  return {at(bounds.min()), at(bounds.max())};
}

std::int32_t gapBetween(const Eigen::AlignedBox3i& a, const Eigen::AlignedBox3i& b) {
  return (a.min() - b.max()).cwiseMax(b.min() - a.max()).maxCoeff();
}

class Grouping {
 public:
  Grouping(const std::vector<std::pair<RegionBox, Cuboid>>& boxes, double cell)
      : boxes_(boxes), parts_(boxes.size()) {
    for (const auto& box : boxes) extents_.push_back(extentOf(box.second, 0.5 * cell));
  }

  std::vector<std::vector<std::uint32_t>> run() {
    linkNeighbours();
    std::vector<std::vector<std::uint32_t>> groups;
    for (std::vector<std::uint32_t>& part : parts()) {
      if (part.size() <= kMaxBoxes && volumeOf(part) <= kMaxVolume) {
        groups.push_back(std::move(part));
      } else {
        addFaces(part, groups);
      }
    }
    groups.erase(std::remove_if(groups.begin(), groups.end(),
                                [&](const std::vector<std::uint32_t>& group) {
                                  return regionOf(group.front()) == regionOf(group.back());
                                }),
                 groups.end());
    std::sort(groups.begin(), groups.end());
    return groups;
  }

 private:
  using Face = std::pair<std::uint64_t, std::uint64_t>;

  std::uint64_t regionOf(std::uint32_t box) const { return boxes_[box].first.region; }

  void linkNeighbours() {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> in_cube;
    for (std::uint32_t i = 0; i < extents_.size(); ++i) {
      const auto cube = [](const Eigen::Vector3i& at, std::int32_t by) {
        return Int3{(at[0] + by) >> kCubeBits, (at[1] + by) >> kCubeBits,
                    (at[2] + by) >> kCubeBits};
      };
      forEachPlace(cube(extents_[i].min(), -kMaxGap), cube(extents_[i].max(), kMaxGap),
                   [&](const Int3& at) { in_cube.emplace_back(packKey(at), i); });
    }
    std::sort(in_cube.begin(), in_cube.end());
    for (auto l = in_cube.begin(); l != in_cube.end(); ++l) {
      for (auto r = l + 1; r != in_cube.end() && r->first == l->first; ++r) {
        link(l->second, r->second);
      }
    }
  }

  void link(std::uint32_t i, std::uint32_t j) {
    const std::int32_t gap = gapBetween(extents_[i], extents_[j]);
    if (gap > kMaxGap) return;
    parts_.unite(i, j);
    if (gap <= kNear && regionOf(i) != regionOf(j)) across_.emplace_back(i, j);
  }

  /// Half cells of the least box around all that has to do with them.
  double volumeOf(const std::vector<std::uint32_t>& part) const {
    Eigen::AlignedBox3i hull;
    for (const std::uint32_t i : part) hull.extend(extents_[i]);
    return (hull.sizes().array() + kAround).cast<double>().prod();
  }

  /// Boxes that hang together.
  std::vector<std::vector<std::uint32_t>> parts() {
    std::vector<std::vector<std::uint32_t>> of_part(boxes_.size());
    for (std::uint32_t i = 0; i < boxes_.size(); ++i) of_part[parts_.of(i)].push_back(i);
    of_part.erase(std::remove_if(of_part.begin(), of_part.end(),
                                 [](const auto& part) { return part.size() < 2; }),
                  of_part.end());
    return of_part;
  }

  /// Boxes of the part that meet others across a border, each at the first face where it can.
  void addFaces(const std::vector<std::uint32_t>& part,
                std::vector<std::vector<std::uint32_t>>& groups) {
    std::map<Face, std::vector<std::uint32_t>> at_face;
    for (const auto& [i, j] : across_) {
      if (parts_.of(i) != parts_.of(part.front())) continue;
      std::vector<std::uint32_t>& boxes = at_face[std::minmax(regionOf(i), regionOf(j))];
      boxes.push_back(i);
      boxes.push_back(j);
    }
    std::vector<char> taken(extents_.size(), 0);
    for (auto& [face, group] : at_face) {
      std::sort(group.begin(), group.end());
      group.erase(std::unique(group.begin(), group.end()), group.end());
      group.erase(std::remove_if(group.begin(), group.end(),
                                 [&](std::uint32_t i) { return taken[i] != 0; }),
                  group.end());
      if (group.empty() || regionOf(group.front()) == regionOf(group.back())) continue;
      for (const std::uint32_t i : group) taken[i] = 1;
      groups.push_back(std::move(group));
    }
  }

  const std::vector<std::pair<RegionBox, Cuboid>>& boxes_;
  std::vector<Eigen::AlignedBox3i> extents_;
  DisjointParts parts_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> across_;  ///< near ones of two regions
};

}  // namespace

std::vector<std::vector<std::uint32_t>> groupAcrossBorders(
    const std::vector<std::pair<RegionBox, Cuboid>>& boxes, double cell) {
  return Grouping(boxes, cell).run();
}

}  // namespace planar_mapping::detail
