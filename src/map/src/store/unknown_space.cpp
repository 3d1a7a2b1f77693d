// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/unknown_space.h"

#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {
namespace {

constexpr std::uint64_t kAllCells = ~std::uint64_t{0};
constexpr int kBlockLevel = 2;
constexpr int kRootLevel = 5;  ///< the walk starts at regions of 32 cells

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
    const std::size_t first = placeOf({low.x >> 2, low.y >> 2, low.z >> 2});
    if (level == kBlockLevel) return blocks_.labels[first] == SpaceRegion::kFree;
    for (const std::size_t step : {0, 1, 8, 9, 64, 65, 72, 73}) {
      if (blocks_.labels[first + step] != SpaceRegion::kFree) return false;
    }
    return true;
  }

  /// The same for a node of a block.
  bool isKnownFreeInBlock(int level, const Int3& low) const {
    const std::size_t block = placeOf({low.x >> 2, low.y >> 2, low.z >> 2});
    return (cellsOf(level, low) & ~blocks_.cellsOf(block).free) == 0;
  }

  /// Marks all cells of a node. What was seen free stays free.
  void mark(int level, const Int3& low, bool free) {
    const Int3 block{low.x >> 2, low.y >> 2, low.z >> 2};
    if (level < kBlockLevel) return mark(block, cellsOf(level, low), free);
    const std::int32_t side = std::int32_t{1} << (level - kBlockLevel);
    for (std::int32_t z = block.z; z < block.z + side; ++z) {
      for (std::int32_t y = block.y; y < block.y + side; ++y) {
        for (std::int32_t x = block.x; x < block.x + side; ++x) mark({x, y, z}, kAllCells, free);
      }
    }
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
  /// Bits of a node of 2^level cells in its block.
  static std::uint64_t cellsOf(int level, const Int3& low) {
    constexpr std::uint64_t kCube[3] = {0x1u, 0x330033u, ~std::uint64_t{0}};
    return kCube[level] << (16 * (low.z & 3) + 4 * (low.y & 3) + (low.x & 3));
  }

  UnknownSpace& space_;
  std::uint64_t key_ = 0;
  bool changed_ = false;
  SpaceRegion::Blocks blocks_;
};

/// Goes down from large cubes to cells and stops where the image says the same of all cells.
/// Stopping early never changes the result: a cube's footprint in the image contains those of its
/// cells at every level of the pyramid.
class UnknownSpace::Walk {
 public:
  Walk(UnknownSpace& space, const DepthImage& image, double cell, double max_range)
      : region_(space), image_(image), cell_(cell), max_range_(max_range) {
    const Matrix3& r = image.inverseRotation();
    for (int level = 0; level <= kRootLevel; ++level) {
      // All cells, each as a box along the camera's axes, about the middle of the cube.
      const double half = 0.5 * cell * static_cast<double>(1 << level);
      half_[level] = image.extentInCamera(Vector3::Constant(half - 0.5 * cell)) +
                     Vector3::Constant(0.5 * cell);
      for (int child = 0; child < 8; ++child) {
        const Vector3 to((child & 1) != 0 ? 0.5 : -0.5, (child & 2) != 0 ? 0.5 : -0.5,
                         (child & 4) != 0 ? 0.5 : -0.5);
        child_[level][child] = r * (half * to);
      }
    }
  }

  void root(const Int3& low) {
    const Vector3 middle =
        cell_ * (Vector3(low.x, low.y, low.z) + Vector3::Constant(0.5 * (1 << kRootLevel)));
    region_.open({low.x >> kBlockLevel, low.y >> kBlockLevel, low.z >> kBlockLevel});
    node(kRootLevel, low, image_.toCamera(middle));
    region_.close();
  }

 private:
  void node(int level, const Int3& low, const Vector3& centre) {
    // What was seen free stays free: nothing to be learnt there.
    if (level >= kBlockLevel && level <= kBlockLevel + 1 && region_.isKnownFree(level, low)) return;
    // Nor in part of a block that will not be marked as hidden any more.
    if (level < kBlockLevel && any_free_ && region_.isKnownFreeInBlock(level, low)) return;
    // Where the image ends nothing is certain; to follow its rim cell by cell is not worth it.
    const bool whole = level < kBlockLevel;
    const DepthImage::Look look = image_.look(centre, half_[level], whole);
    if (whole && !look.inside) return;
    if (!look.visible || look.near > max_range_ || look.farthest <= 0.0f) return;
    const bool hidden = look.farthest < look.near;
    if (look.inside && look.far <= max_range_) {
      if (hidden) return mark(level, low, false);
      if (look.nearest > look.far) return mark(level, low, true);
    }
    if (level == 0) {
      if (look.farthest > look.far && look.far <= max_range_ && look.near > 0.0) {
        mark(level, low, true);
      }
      return;
    }
    if (level == kBlockLevel && hidden) {
      const DepthImage::Look middle = image_.look(centre, half_[0], true);
      if (middle.inside && middle.far <= max_range_) region_.mark(level, low, false);
      return;
    }
    if (level == kBlockLevel) any_free_ = any_hidden_ = false;
    const std::int32_t half = std::int32_t{1} << (level - 1);
    for (int child = 0; child < 8; ++child) {
      node(level - 1,
           {low.x + ((child & 1) != 0 ? half : 0), low.y + ((child & 2) != 0 ? half : 0),
            low.z + ((child & 4) != 0 ? half : 0)},
           centre + child_[level][child]);
    }
    // Nothing of it was seen free: what is not hidden is where the surface is.
    if (level == kBlockLevel && any_hidden_ && !any_free_) region_.mark(level, low, false);
  }

  void mark(int level, const Int3& low, bool free) {
    (free ? any_free_ : any_hidden_) = true;
    region_.mark(level, low, free);
  }

  OpenRegion region_;
  const DepthImage& image_;
  const double cell_;
  const double max_range_;
  Vector3 half_[kRootLevel + 1];
  Vector3 child_[kRootLevel + 1][8];
  bool any_free_ = false;  ///< what this image says of the block being walked through
  bool any_hidden_ = false;
};

void UnknownSpace::integrate(const DepthImage& image, double cell, double max_range) {
  Vector3 low, high;
  image.bounds(max_range, low, high);
  constexpr std::int32_t kSide = 1 << kRootLevel;
  constexpr double kLimit = kLatticeLimit / kSide - 1;
  low = (low / (cell * kSide)).array().floor().max(-kLimit).min(kLimit);
  high = (high / (cell * kSide)).array().floor().max(-kLimit).min(kLimit);
  Walk walk(*this, image, cell, max_range);
  for (auto z = static_cast<std::int32_t>(low.z()); z <= high.z(); ++z) {
    for (auto y = static_cast<std::int32_t>(low.y()); y <= high.y(); ++y) {
      for (auto x = static_cast<std::int32_t>(low.x()); x <= high.x(); ++x) {
        walk.root({x * kSide, y * kSide, z * kSide});
      }
    }
  }
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

UnknownSpace::Surroundings UnknownSpace::around(const Int3& cell) const {
  const Int3 block{cell.x >> 2, cell.y >> 2, cell.z >> 2};
  const SpaceRegion* region = regions_.find(regionOf(block));
  if (region == nullptr) return {0, true};
  return {region->unknownOf(placeOf(block)), false};
}

std::size_t UnknownSpace::memoryBytes() const {
  std::size_t bytes = regions_.memoryBytes();
  for (std::size_t r = 0; r < regions_.size(); ++r) bytes += regions_.value(r).memoryBytes();
  return bytes;
}

}  // namespace planar_mapping::detail
