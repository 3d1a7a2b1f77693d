// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/store/unknown_space.h"

#include <cmath>
#include <utility>

#include "planar_mapping/base/lists.h"

namespace planar_mapping::detail {
namespace {

constexpr std::uint64_t kAllCells = ~std::uint64_t{0};
constexpr int kRootLevel = 9;  ///< the walk starts at cubes of 512 cells
/// Blocks of which the side is less than this fraction of their distance are free as a whole or not
/// at all; those of s = 0.1 m from 16 m on.
constexpr double kFarBlock = 0.025;
/// Up to so many cells from the sensor a cell is free if any ray passes it.
constexpr double kNearCells = 5.0;

/// How far the rays of a sparse image are followed, metres.
double longestRay(const DepthImage& image, double cell, SpaceBudget& budget) {
  const double unlimited = std::numeric_limits<double>::infinity();
  if (!image.isSparse()) return unlimited;
  const auto cellsWithin = [&](double range) {
    double cells = 0.0;
    image.forEachRay([&](const Vector3& ray, double depth) {
      cells += std::min(depth, range / ray.norm()) * ray.lpNorm<1>() / cell;
    });
    return cells;
  };
  const double all = cellsWithin(unlimited);
  if (all <= budget.ray_cells) {
    budget.ray_cells -= all;
    return unlimited;
  }
  constexpr int kHalvings = 30;
  double low = 0.0;
  double high = cell * kLatticeLimit;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (cellsWithin(middle) <= budget.ray_cells ? low : high) = middle;
  }
  budget.ray_cells = 0.0;
  budget.range = std::min(budget.range, low);
  return low;
}

}  // namespace

/// A region while it is worked on: with room for the cells of every block.
class UnknownSpace::OpenRegion {
 public:
  explicit OpenRegion(UnknownSpace& space) : space_(space) {}

  /// The region of a block.
  void open(const Int3& block) {
    key_ = regionOf(block);
    changed_ = false;
    const SpaceRegion* region = space_.regions_.find(key_);
    if (region != nullptr) {
      region->unpack(blocks_);
    } else {
      blocks_.labels.fill(SpaceRegion::kNever);
    }
  }

  /// Are all cells of a node known to be free? \param level that of a block or of 2 x 2 x 2 blocks
  bool isKnownFree(int level, const Int3& low) const {
    const std::size_t first = placeOf(blockOf(low));
    if (level == kBlockLevel) return blocks_.labels[first] == SpaceRegion::kFree;
    for (const std::size_t step : {0, 1, 8, 9, 64, 65, 72, 73}) {
      if (blocks_.labels[first + step] != SpaceRegion::kFree) return false;
    }
    return true;
  }

  /// Marks all cells of a node of blocks. What was seen free stays free.
  void mark(int level, const Int3& low, bool free) {
    const Int3 block = blockOf(low);
    const std::int32_t side = std::int32_t{1} << (level - kBlockLevel);
    forEachPlace(block, {block.x + side - 1, block.y + side - 1, block.z + side - 1},
                 [&](const Int3& at) { mark(at, kAllCells, free); });
  }
  void mark(const Int3& block, std::uint64_t cells, bool free) {
    const std::size_t i = placeOf(block);
    std::uint8_t& label = blocks_.labels[i];
    if (cells == 0 || label == SpaceRegion::kFree || (label == SpaceRegion::kUnknown && !free))
      return;
    if (cells == kAllCells && (free || label == SpaceRegion::kNever)) {
      label = free ? SpaceRegion::kFree : SpaceRegion::kUnknown;
      changed_ = true;
      return;
    }
    Block& bits = blocks_.cells[i];
    if (label != SpaceRegion::kMixed) bits = {0, label == SpaceRegion::kUnknown ? kAllCells : 0};
    const Block before = bits;
    if (free) {
      bits.free |= cells;
      bits.unknown &= ~cells;
    } else {
      bits.unknown |= cells & ~bits.free;
    }
    changed_ |=
        label != SpaceRegion::kMixed || bits.free != before.free || bits.unknown != before.unknown;
    label = bits.free == kAllCells      ? SpaceRegion::kFree
            : bits.unknown == kAllCells ? SpaceRegion::kUnknown
                                        : SpaceRegion::kMixed;
  }

  void close() {
    if (changed_) space_.regions_[key_].pack(blocks_);
  }

 private:
  UnknownSpace& space_;
  std::uint64_t key_ = 0;
  bool changed_ = false;
  SpaceRegion::Blocks blocks_;
};

/// Goes down from large cubes to blocks and stops where the image says the same of all cells.
/// Stopping early never changes the result: a cube's footprint in the image contains those of its
/// cells at every level of the pyramid.
class UnknownSpace::Walk {
 public:
  Walk(UnknownSpace& space, const DepthImage& image, double cell, double max_range,
       SpaceBudget& budget)
      : budget_(budget),
        whole_regions_(budget.cubes / 2),
        space_(space),
        region_(space),
        image_(image),
        cell_(cell),
        max_range_(max_range),
        marks_hidden_(!space.isUnseenUnknown()),
        axes_(cell * image.inverseRotation()),
        offsets_(axes_) {
    for (int level = 0; level <= kRootLevel; ++level) {
      // All cells, each as a box along the camera's axes, about the middle of the cube.
      const double half = 0.5 * cell * static_cast<double>(1 << level);
      half_[level] = image.extentInCamera(Vector3::Constant(half - 0.5 * cell)) +
                     Vector3::Constant(0.5 * cell);
      for (int child = 0; child < 8; ++child) {
        const Vector3 to(child & 1, child >> 1 & 1, child >> 2);
        child_[level][child] = image.inverseRotation() * (half * (to - Vector3::Constant(0.5)));
      }
    }
  }

  void root(const Int3& low) {
    const Vector3 middle =
        cell_ * (Vector3(low.x, low.y, low.z) + Vector3::Constant(0.5 * (1 << kRootLevel)));
    node(kRootLevel, low, image_.toCamera(middle));
  }

 private:
  void node(int level, const Int3& low, const Vector3& centre) {
    // What was seen free stays free: nothing to be learnt there.
    if (level == kRegionLevel && space_.isFreeRegion(low)) return;
    if (level <= kBlockLevel + 1 && region_.isKnownFree(level, low)) return;
    if (budget_.cubes == 0) return leave(level, centre);
    --budget_.cubes;
    const DepthImage::Look look = image_.look(centre, half_[level], false);
    if (!look.visible) return;
    const bool hides = marks_hidden_ && look.farthest > 0.0f && look.near <= max_range_;
    if (!(look.clearest > look.near) && !hides) return;
    const bool is_hidden = hides && look.farthest < look.near;
    if (look.inside) {
      if (look.clear > look.far) return free(level, low);
      if (is_hidden && look.far <= max_range_ && level <= kRegionLevel) {
        if (level == kRegionLevel) region_.open(blockOf(low));
        region_.mark(level, low, false);
        if (level == kRegionLevel) region_.close();
        return;
      }
    }
    const bool is_far = cell_ * static_cast<double>(1 << level) <= kFarBlock * look.near;
    if (level == kBlockLevel) return block(blockOf(low), centre, is_hidden, is_far);
    if (is_far && !hides) return;
    if (level == kRegionLevel && budget_.cubes < whole_regions_) return leave(level, centre);
    if (level == kRegionLevel) region_.open(blockOf(low));
    const std::int32_t half = std::int32_t{1} << (level - 1);
    for (int child = 0; child < 8; ++child) {
      const Int3 at{low.x + half * (child & 1), low.y + half * (child >> 1 & 1),
                    low.z + half * (child >> 2)};
      node(level - 1, at, centre + child_[level][child]);
    }
    if (level == kRegionLevel) region_.close();
  }

  /// Not classified: that would be over the budget.
  void leave(int level, const Vector3& centre) {
    const double half = 0.5 * cell_ * static_cast<double>(1 << level);
    budget_.range = std::min(budget_.range, std::max(0.0, centre.norm() - std::sqrt(3.0) * half));
  }

  void free(int level, const Int3& low) {
    if (level < kRegionLevel) return region_.mark(level, low, true);
    const auto regionAt = [](std::int32_t cell) { return cell >> kRegionLevel; };
    const std::int32_t last = (1 << (level - kRegionLevel)) - 1;
    const Int3 first{regionAt(low.x), regionAt(low.y), regionAt(low.z)};
    forEachPlace(first, {first.x + last, first.y + last, first.z + last}, [&](const Int3& region) {
      space_.regions_[packKey(region)] = SpaceRegion::allOf(SpaceRegion::kFree);
    });
  }

  /// Cell by cell. \param is_hidden all of it, as far as the image sees it
  void block(const Int3& at, const Vector3& centre, bool is_hidden, bool is_far) {
    const std::uint64_t free =
        is_far || image_.isSparse() ? 0 : image_.clearCells(centre, offsets_);
    region_.mark(at, free, true);
    if (!marks_hidden_) return;
    std::uint64_t hidden = 0;
    if (is_hidden) {
      hidden = isHidden(centre) ? kAllCells : 0;
    } else {
      for (int bit = 0; bit < 64; ++bit) {
        if ((free >> bit & 1u) != 0) continue;
        const Vector3 offset((bit & 3) - 1.5, (bit >> 2 & 3) - 1.5, (bit >> 4) - 1.5);
        hidden |= std::uint64_t{isHidden(centre + axes_ * offset)} << bit;
      }
      // Nothing of it was seen free: what is not hidden is where the surface is.
      if (hidden != 0 && free == 0) hidden = kAllCells;
    }
    region_.mark(at, hidden, false);
  }

  /// Does the cell lie behind all that is measured over it?
  bool isHidden(const Vector3& centre) const {
    const DepthImage::Look look = image_.look(centre, half_[0], true);
    return look.inside && look.far <= max_range_ && look.farthest > 0.0f &&
           look.farthest < look.near;
  }

  SpaceBudget& budget_;
  const std::size_t whole_regions_;  ///< from so many cubes left on
  UnknownSpace& space_;
  OpenRegion region_;
  const DepthImage& image_;
  const double cell_;
  const double max_range_;
  const bool marks_hidden_;
  const Matrix3 axes_;  ///< from cell to cell, in the camera's frame
  const CellOffsets offsets_;
  Vector3 half_[kRootLevel + 1];
  Vector3 child_[kRootLevel + 1][8];
};

/// Leaves out blocks of the farthest regions that are too many.
/// \param origin  of the rays, in cells
/// \param blocks  region by region
void UnknownSpace::keepNearest(const Vector3& origin, double cell, std::vector<PlacedBlock>& blocks,
                               SpaceBudget& budget) {
  constexpr double kSide = 1 << kRegionLevel;
  const auto distanceOf = [&](const PlacedBlock& block) {
    const Vector3 low(block.at.x >> 3, block.at.y >> 3, block.at.z >> 3);
    const Vector3 middle = kSide * (low + Vector3::Constant(0.5));
    return std::max(0.0, (middle - origin).norm() - 0.5 * std::sqrt(3.0) * kSide);
  };
  std::vector<double> distances;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (i > 0 && regionOf(blocks[i].at) == regionOf(blocks[i - 1].at)) continue;
    distances.push_back(distanceOf(blocks[i]));
  }
  if (distances.size() <= budget.regions) return;
  const double farthest = ranked(distances, budget.regions);
  eraseIf(blocks, [&](const PlacedBlock& b) { return distanceOf(b) >= farthest; });
  budget.range = std::min(budget.range, cell * farthest);
}

/// Marks the cells that rays pass: of a sparse image to their ends, but for the cell where they
/// end.
void UnknownSpace::integrateRays(const DepthImage& image, double cell, SpaceBudget& budget) {
  KeyMap<std::uint64_t> blocks;
  const double longest = longestRay(image, cell, budget);
  const Vector3 origin = image.position() / cell;
  image.forEachRay([&](const Vector3& ray, double depth) {
    depth = std::min(depth, image.isSparse() ? longest / ray.norm() : kNearCells * cell);
    const Vector3 end = origin + depth / cell * ray;
    constexpr double kLimit = kLatticeLimit - 1;
    if (!(std::max(origin.cwiseAbs().maxCoeff(), end.cwiseAbs().maxCoeff()) < kLimit)) return;
    Vector3 at = origin.array().floor(), next, step;
    for (int i = 0; i < 3; ++i) {
      const double border = ray[i] > 0.0 ? at[i] + 1.0 : at[i];
      const double length = end[i] - origin[i];
      next[i] = length == 0.0 ? 2.0 : (border - origin[i]) / length;
      step[i] = length == 0.0 ? 2.0 : 1.0 / std::abs(length);
    }
    std::uint64_t key = 0;
    std::uint64_t cells = 0;
    for (int axis = 0;;) {
      const Int3 c = toInt3(at);
      next.minCoeff(&axis);
      if (next[axis] > 1.0 && image.isSparse()) break;
      if (packKey(blockOf(c)) != key) {
        if (cells != 0) blocks[key] |= cells;
        key = packKey(blockOf(c));
        cells = 0;
      }
      cells |= std::uint64_t{1} << bitOf(c);
      if (next[axis] > 1.0) break;
      at[axis] += ray[axis] > 0.0 ? 1.0 : -1.0;
      next[axis] += step[axis];
    }
    if (cells != 0) blocks[key] |= cells;
  });
  std::vector<PlacedBlock> placed;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    placed.push_back({unpackKey(blocks.key(i)), {blocks.value(i), 0}});
  }
  std::sort(placed.begin(), placed.end(), [](const PlacedBlock& a, const PlacedBlock& b) {
    return regionOf(a.at) < regionOf(b.at);
  });
  keepNearest(origin, cell, placed, budget);
  add(placed);
}

void UnknownSpace::integrate(const DepthImage& image, double cell, double max_range,
                             SpaceBudget& budget) {
  const double range = isUnseenUnknown() ? image.clearest() : max_range;
  if (!(image.clearest() > 0.0f)) return;
  const Eigen::AlignedBox3d bounds = image.bounds(range);
  constexpr std::int32_t kSide = 1 << kRootLevel;
  constexpr double kLimit = kLatticeLimit / kSide - 1;
  const Vector3 low = (bounds.min() / (cell * kSide)).array().floor().max(-kLimit).min(kLimit);
  const Vector3 high = (bounds.max() / (cell * kSide)).array().floor().max(-kLimit).min(kLimit);
  integrateRays(image, cell, budget);
  if (image.isSparse() && isUnseenUnknown()) return;
  // The budget goes to what is near.
  const Vector3 sensor = image.position() / (cell * kSide) - Vector3::Constant(0.5);
  std::vector<std::pair<double, Int3>> roots;
  forEachPlace(toInt3(low), toInt3(high), [&](const Int3& at) {
    roots.emplace_back((Vector3(at.x, at.y, at.z) - sensor).norm(),
                       Int3{at.x * kSide, at.y * kSide, at.z * kSide});
  });
  std::stable_sort(roots.begin(), roots.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  Walk walk(*this, image, cell, max_range, budget);
  for (const auto& root : roots) walk.root(root.second);
}

void UnknownSpace::add(const std::vector<PlacedBlock>& blocks) {
  OpenRegion region(*this);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Int3& at = blocks[i].at;
    if (i == 0 || regionOf(at) != regionOf(blocks[i - 1].at)) {
      if (i > 0) region.close();
      region.open(at);
    }
    region.mark(at, blocks[i].cells.free, true);
    region.mark(at, blocks[i].cells.unknown, false);
  }
  if (!blocks.empty()) region.close();
}

void UnknownSpace::add(const Int3& at, const SpaceRegion& region) {
  const SpaceRegion* known = this->region(at);
  if (known == nullptr || region.isAllFree()) return setRegion(at, region);
  if (known->isAllFree()) return;
  std::vector<PlacedBlock> blocks;
  forEachBlock(at, region, [&](const Int3& block, const Block& cells) {
    blocks.push_back({block, cells});
  });
  add(blocks);
}

void UnknownSpace::add(const UnknownSpace& other) {
  other.forEachRegion([this](const Int3& at, const SpaceRegion& region) { add(at, region); });
}

UnknownSpace::Surroundings UnknownSpace::around(const Int3& cell) const {
  const Int3 block = blockOf(cell);
  const SpaceRegion* region = regions_.find(regionOf(block));
  if (region == nullptr) return {isUnseenUnknown() ? kAllCells : 0, true};
  if (region->isAllFree()) return {0, true};
  const std::size_t place = placeOf(block);
  const SpaceBlock cells = region->cellsOf(place);
  return {isUnseenUnknown() ? ~cells.free : cells.unknown, false};
}

std::size_t UnknownSpace::memoryBytes() const {
  std::size_t bytes = regions_.memoryBytes();
  for (const SpaceRegion& region : regions_.values()) bytes += region.memoryBytes();
  return bytes;
}

}  // namespace planar_mapping::detail
