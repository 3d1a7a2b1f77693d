// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/cuboids/joined_boxes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "planar_mapping/base/disjoint_parts.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/map/cuboids/cover_geometry.h"
#include "planar_mapping/map/store/surface_band.h"

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

/// Groups of boxes of several regions that one cover may do better: those that hang together, so
/// near each other that boxes may take over what others stand for. Where too many do, only those
/// that meet at a face between two regions. What is near a group decides, not the order in which
/// regions were covered.
class Grouping {
 public:
  /// \param boxes with axes of the world, on the lattice of half cells; ascending by region, number
  Grouping(const std::vector<JoinedBoxes::PlacedBox>& boxes, double cell)
      : boxes_(boxes), parts_(boxes.size()) {
    for (const auto& box : boxes) extents_.push_back(extentOf(box.second, 0.5 * cell));
  }

  /// Positions of the boxes of each, ascending; groups by their first box.
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
    eraseIf(groups, [&](const std::vector<std::uint32_t>& group) {
      return regionOf(group.front()) == regionOf(group.back());
    });
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
    eraseIf(of_part, [](const auto& part) { return part.size() < 2; });
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
      makeDistinct(group);
      eraseIf(group, [&](std::uint32_t i) { return taken[i] != 0; });
      if (group.empty() || regionOf(group.front()) == regionOf(group.back())) continue;
      for (const std::uint32_t i : group) taken[i] = 1;
      groups.push_back(std::move(group));
    }
  }

  const std::vector<JoinedBoxes::PlacedBox>& boxes_;
  std::vector<Eigen::AlignedBox3i> extents_;
  DisjointParts parts_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> across_;  ///< near ones of two regions
};

/// Cells so far from a box have to do with it: it stands for what is half a cell beside it, and may
/// become one that holds another half.
constexpr double kReach = 2.0;

/// Covers anew, across borders, what a group of boxes of several regions stands for.
class GroupCover {
 public:
  GroupCover(const MapData& map, const std::vector<Cuboid>& boxes) : map_(map) {
    const double s = map.resolution();
    for (const Cuboid& box : boxes) {
      const Eigen::AlignedBox3d around = boundsOf(box, kReach * s);
      bounds_.extend(around);
      forEachPlace(blockOf(around.min(), s), blockOf(around.max(), s),
                   [&](const Int3& block) { blocks_.push_back(packKey(block)); });
    }
    makeDistinct(blocks_);
    for (const std::uint64_t block : blocks_) {
      const std::uint64_t region = map.cells.regionKey(unpackKey(block));
      if (regions_.empty() || regions_.back() != region) regions_.push_back(region);
    }
    makeDistinct(regions_);
  }

  /// Those that have to do with the group, whether or not they hold one of its boxes; ascending. As
  /// long as nothing changes in them the cover stays the same.
  const std::vector<std::uint64_t>& regions() const { return regions_; }

  /// Adds a cover that has or absorbs something in one of them. Those of a plane come together.
  void add(const PlaneLayer& plane, const PatchCover& cover) {
    const CuboidApproximationParams& params = map_.params.approximation;
    const double s = map_.resolution();
    const SurfaceBand band = surfaceBand(map_, cover.spread);
    if (near_.empty() || near_.back() != &plane) near_.push_back(&plane);
    const PlaneFrame& frame = plane.frame();
    for (const PatchCover::Rectangle& rectangle : cover.rectangles) {
      const Cuboid cuboid = cuboidOf(rectangle.place, frame, band, params);
      if (!boundsOf(cuboid, s).intersects(bounds_)) continue;
      if (!rectangle.replaced) {
        present_.push_back(cuboid);
        continue;
      }
      for (const SurfacePiece& piece :
           piecesOf(rectangle.place, plane.raster, frame, band, params)) {
        if (isNear(blockOf(piece.center, s))) pieces_.push_back(piece);
      }
    }
    for (const LooseQuarter& quarter : cover.loose) {
      if (!isNear(blockOf(centerOf(quarter, frame, s), s))) continue;
      addPieces(quarter, frame, params, pieces_);
    }
  }

  /// The cover of what was added and of the cells, if it needs fewer boxes; else these.
  std::vector<Cuboid> run(const std::vector<Cuboid>& boxes) const {
    std::vector<Cuboid> again =
        coverAgain(boxes, cells(), pieces_, present_, map_.params.approximation);
    if (again.size() >= boxes.size()) return boxes;
    namePlanes(map_, near_, again);
    return again;
  }

 private:
  bool isNear(const Int3& block) const {
    return std::binary_search(blocks_.begin(), blocks_.end(), packKey(block));
  }

  std::vector<NonPlanarCell> cells() const {
    std::vector<NonPlanarCell> cells;
    for (const std::uint64_t key : regions_) {
      const std::size_t region = map_.cells.regions.indexOf(key);
      if (region == KeyMap<CellLayer::Region>::kNone) continue;
      for (const NonPlanarCell& cell : map_.cells.cellsOf(region, map_.params.approximation)) {
        if (isNear(CellLayer::blockOf({cell.x, cell.y, cell.z}))) cells.push_back(cell);
      }
    }
    return cells;
  }

  const MapData& map_;
  std::vector<std::uint64_t> blocks_;  ///< that the boxes come near, ascending
  std::vector<std::uint64_t> regions_;
  Eigen::AlignedBox3d bounds_;  ///< of the boxes
  std::vector<const PlaneLayer*> near_;
  std::vector<SurfacePiece> pieces_;
  std::vector<Cuboid> present_;
};

/// All that a box says.
std::array<double, 12> numbersOf(const Cuboid& box) {
  std::array<double, 12> numbers;
  Eigen::Map<Eigen::Matrix<double, 12, 1>>(numbers.data()) << box.center, box.size,
      box.orientation.coeffs(), box.plane_id, box.probability;
  return numbers;
}

}  // namespace

void JoinedBoxes::release(const std::vector<std::uint64_t>& regions) {
  if (regions.empty()) return;
  complete_ = false;
  const auto isChanged = [&](std::uint64_t region) {
    return std::binary_search(regions.begin(), regions.end(), region);
  };
  const auto isOver = [&](const Group& group) {
    return std::any_of(group.regions.begin(), group.regions.end(), isChanged);
  };
  eraseIf(groups_, isOver);
}

std::size_t JoinedBoxes::size() const {
  std::size_t size = 0;
  if (complete_) {
    for (const Group& group : groups_) size += group.boxes.size();
  }
  return size;
}

void JoinedBoxes::appendTo(std::vector<Cuboid>& boxes) const {
  for (const Group& group : groups_) {
    boxes.insert(boxes.end(), group.boxes.begin(), group.boxes.end());
  }
}

std::size_t JoinedBoxes::memoryBytes() const {
  std::size_t bytes = capacityBytes(groups_);
  for (const Group& g : groups_) {
    bytes += capacityBytes(g.members) + capacityBytes(g.regions) + capacityBytes(g.replaced) +
             capacityBytes(g.boxes);
  }
  return bytes;
}

/// Members that are among the boxes as they are stay their regions'.
void JoinedBoxes::replace(const std::vector<Cuboid>& members, std::vector<Cuboid> boxes,
                          Group& group) {
  const auto isBefore = [](const Cuboid& l, const Cuboid& r) {
    return numbersOf(l) < numbersOf(r);
  };
  std::sort(boxes.begin(), boxes.end(), isBefore);
  group.replaced.assign(members.size(), 1);
  for (std::size_t i = 0; i < members.size(); ++i) {
    const auto same = std::lower_bound(boxes.begin(), boxes.end(), members[i], isBefore);
    if (same == boxes.end() || isBefore(members[i], *same)) continue;
    group.replaced[i] = 0;
    boxes.erase(same);
  }
  group.boxes = std::move(boxes);
}

std::vector<RegionBox> JoinedBoxes::join(const MapData& map, const std::vector<PlacedBox>& boxes,
                                         const std::vector<PatchCover>& covers) {
  KeyMap<std::vector<std::uint64_t>> covers_in;  // positions, by region
  for (std::size_t c = 0; c < covers.size(); ++c) {
    for (const std::uint64_t key : covers[c].regions) covers_in[key].push_back(c);
  }
  std::vector<Group> before = std::exchange(groups_, {});
  auto old = before.begin();
  std::vector<std::pair<std::size_t, std::vector<Cuboid>>> tasks;  // a group, and its members
  for (const std::vector<std::uint32_t>& positions : Grouping(boxes, map.resolution()).run()) {
    Group group;
    for (const std::uint32_t i : positions) group.members.push_back(boxes[i].first);
    while (old != before.end() && old->members.front() < group.members.front()) ++old;
    if (old != before.end() && old->members == group.members) {
      group = std::move(*old++);
    } else {
      tasks.emplace_back(groups_.size(), std::vector<Cuboid>());
      for (const std::uint32_t i : positions) tasks.back().second.push_back(boxes[i].second);
    }
    groups_.push_back(std::move(group));
  }
  parallelFor(tasks.size(), map.params.approximation.threads, [&](std::size_t i) {
    const auto& [number, members] = tasks[i];
    GroupCover again(map, members);
    std::vector<std::uint64_t> near;
    for (const std::uint64_t key : again.regions()) {
      const std::vector<std::uint64_t>* some = covers_in.find(key);
      if (some != nullptr) near.insert(near.end(), some->begin(), some->end());
    }
    makeDistinct(near);
    for (const std::uint64_t c : near) again.add(map.plane(covers[c].plane), covers[c]);
    Group& group = groups_[number];
    group.regions = again.regions();
    replace(members, again.run(members), group);
  });
  std::vector<RegionBox> joined;
  for (const Group& group : groups_) {
    for (std::size_t i = 0; i < group.members.size(); ++i) {
      if (group.replaced[i] != 0) joined.push_back(group.members[i]);
    }
  }
  complete_ = true;
  return joined;
}

}  // namespace planar_mapping::detail
