// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/oriented_box.h"
#include "planar_mapping/map/store/unknown_space.h"

namespace planar_mapping::detail {
namespace {

constexpr std::int32_t kRegionSide = 1 << UnknownSpace::kRegionLevel;  // cells
/// Regions that are alike and yet taken cell by cell: 4 KiB each.
constexpr std::size_t kMaxUnfolded = std::size_t{1} << 15;

/// Clears the cells of a cube whose centre the cuboid contains.
void clearOccupied(const Int3& cube, const Cuboid& cuboid, double cell, CubeBits& bits) {
  const Matrix3 to_local = cuboid.orientation.conjugate().toRotationMatrix();
  const Vector3 half = 0.5 * cuboid.size;
  const Vector3 middle = 8.0 * cell * (Vector3(cube.x, cube.y, cube.z) + Vector3::Constant(0.5));
  const Vector3 local = to_local * (middle - cuboid.center);
  const double radius = 4.0 * std::sqrt(3.0) * cell;
  const double rounding = 1e-9 * cell;
  if (((local.cwiseAbs() - half).array() > radius).any()) return;
  const Vector3 around = reach(cuboid), corner = 8.0 * Vector3(cube.x, cube.y, cube.z);
  const Vector3 low = (cuboid.center - around) / cell - corner - Vector3::Constant(0.5 + 1e-6);
  const Vector3 high = (cuboid.center + around) / cell - corner - Vector3::Constant(0.5 - 1e-6);
  const Int3 first = toInt3(low.array().ceil().max(0.0).min(8.0));
  const Int3 end = toInt3((high.array().floor() + 1.0).max(0.0).min(8.0));
  std::uint64_t inside = 0;  // of a layer
  for (int y = first.y; y < end.y; ++y)
    for (int x = first.x; x < end.x; ++x) inside |= std::uint64_t{1} << (8 * y + x);
  for (auto z = std::size_t(first.z); z < std::size_t(end.z); ++z) {
    for (std::uint64_t left = bits[z] & inside; left != 0; left &= left - 1) {
      const int bit = __builtin_ctzll(left);
      const Vector3 offset =
          cell * (Vector3(bit & 7, bit >> 3, static_cast<double>(z)) - Vector3::Constant(3.5));
      const Vector3 at = local + to_local * offset;
      const double outside = (at.cwiseAbs() - half).maxCoeff();
      if (outside > rounding) continue;
      // On a face rounding decides: as PlanarMap::stateAt() does.
      if (outside > -rounding) {
        const Vector3 centre =
            cell * (8.0 * Vector3(cube.x, cube.y, cube.z) +
                    Vector3((bit & 7) + 0.5, (bit >> 3) + 0.5, static_cast<double>(z) + 0.5));
        if (!contains(cuboid, centre)) continue;
      }
      bits[z] &= ~(std::uint64_t{1} << bit);
    }
  }
}

/// Calls visit(coordinates, value) for the entries of a lattice of such a side around a cuboid.
template <typename Value, typename Visit>
void forEachAround(const Cuboid& cuboid, double side, KeyMap<Value>& entries, Visit&& visit) {
  const double limit = kLatticeLimit / 8;
  const Vector3 half = reach(cuboid);
  const Vector3 low = ((cuboid.center - half) / side).array().floor().max(-limit).min(limit - 1);
  const Vector3 high = ((cuboid.center + half) / side).array().floor().max(-limit).min(limit - 1);
  if ((high - low + Vector3::Ones()).prod() > static_cast<double>(entries.size())) {
    for (std::size_t i = 0; i < entries.size(); ++i)
      visit(unpackKey(entries.key(i)), entries.value(i));
    return;
  }
  forEachPlace(toInt3(low), toInt3(high), [&](const Int3& at) {
    Value* value = entries.find(packKey(at));
    if (value != nullptr) visit(at, *value);
  });
}

/// Collects the cells of a state.
class Collector {
 public:
  Collector(const UnknownSpace& space, CellState state, const SpaceBox& box, double cell)
      : space_(space), is_free_(state == CellState::Free), cell_(cell) {
    // Cells with their middles in the box.
    lowest_ = box.low.unaryExpr([cell](double at) { return std::ceil(at / cell - 0.5); });
    highest_ = box.high.unaryExpr([cell](double at) { return std::floor(at / cell - 0.5); });
  }

  SpaceCells collect(const std::vector<Cuboid>& occupied) {
    space_.forEachRegion([this](const Int3& at, const SpaceRegion& region) { take(at, region); });
    for (const Cuboid& cuboid : occupied) takeFromRegions(cuboid);
    cells_.regions.removeIf([](std::uint64_t, std::uint8_t is_whole) { return is_whole == 0; });
    for (const Cuboid& cuboid : occupied) {
      forEachAround(cuboid, 8.0 * cell_, cells_.cubes, [&](const Int3& cube, CubeBits& bits) {
        clearOccupied(cube, cuboid, cell_, bits);
      });
    }
    return std::move(cells_);
  }

 private:
  std::uint64_t ofState(const SpaceBlock& block) const {
    return is_free_ ? block.free : space_.isUnseenUnknown() ? ~block.free : block.unknown;
  }
  bool isBeyond(const Vector3& corner, double side) const {
    return (corner.array() > highest_.array()).any() ||
           (corner.array() + (side - 1.0) < lowest_.array()).any();
  }
  bool isWithin(const Vector3& corner, double side) const {
    return (corner.array() >= lowest_.array()).all() &&
           (corner.array() + (side - 1.0) <= highest_.array()).all();
  }

  void take(const Int3& at, const SpaceRegion& region) {
    const Vector3 corner = kRegionSide * Vector3(at.x, at.y, at.z);
    if (isBeyond(corner, kRegionSide)) return;
    if (region.label() != SpaceRegion::kMixed) {
      if (ofState(region.cellsOf(0)) == 0) return;
      if (isWithin(corner, kRegionSide)) {
        cells_.regions[packKey(at)] = 1;
        return;
      }
      countUnfolded();
    }
    space_.forEachBlock(at, region, [this](const Int3& block, const SpaceBlock& cells) {
      take(block, ofState(cells));
    });
  }

  void take(const Int3& at, std::uint64_t cells) {
    const Vector3 corner = 4.0 * Vector3(at.x, at.y, at.z);
    if (cells == 0 || isBeyond(corner, 4.0)) return;
    if (!isWithin(corner, 4.0)) {
      forEachBit(cells, [&](std::size_t bit) {
        const Vector3 c = corner + Vector3(bit & 3u, bit >> 2u & 3u, bit >> 4u);
        if (!isWithin(c, 1.0)) cells &= ~(std::uint64_t{1} << bit);
      });
      if (cells == 0) return;
    }
    CubeBits& bits = cells_.cubes[packKey(Int3{at.x >> 1, at.y >> 1, at.z >> 1})];
    for (int slice = 0; slice < 4; ++slice) {
      std::uint64_t rows = 0;
      for (int row = 0; row < 4; ++row) {
        rows |= ((cells >> (16 * slice + 4 * row)) & 0xfu) << (8 * row);
      }
      bits[static_cast<std::size_t>(4 * (at.z & 1) + slice)] |=
          rows << (32 * (at.y & 1) + 4 * (at.x & 1));
    }
  }

  /// Whole regions that the cuboid meets become cubes, those that it fills go.
  void takeFromRegions(const Cuboid& cuboid) {
    if (cells_.regions.empty()) return;
    const OrientedBox box(cuboid);
    const double side = kRegionSide * cell_;
    const Vector3 half = Vector3::Constant(0.5 * side);
    forEachAround(cuboid, side, cells_.regions, [&](const Int3& at, std::uint8_t& is_whole) {
      const Vector3 middle = side * (Vector3(at.x, at.y, at.z) + Vector3::Constant(0.5));
      if (is_whole == 0 || !box.meets(middle, half)) return;
      is_whole = 0;
      if (box.contains(middle, half)) return;
      countUnfolded();
      CubeBits all;
      all.fill(~std::uint64_t{0});
      const Int3 first{4 * at.x, 4 * at.y, 4 * at.z};
      forEachPlace(first, {first.x + 3, first.y + 3, first.z + 3},
                   [&](const Int3& cube) { cells_.cubes[packKey(cube)] = all; });
    });
  }

  void countUnfolded() {
    if (++unfolded_ <= kMaxUnfolded) return;
    throw InputError("the space of the map is too wide to be listed: more than " +
                     std::to_string(kMaxUnfolded) + " cubes of " + std::to_string(kRegionSide) +
                     " cells that are alike are cut by what is occupied or by the box");
  }

  const UnknownSpace& space_;
  const bool is_free_;
  const double cell_;
  Vector3 lowest_, highest_;  ///< cells
  SpaceCells cells_;
  std::size_t unfolded_ = 0;
};

/// Cells left to be put into boxes.
class Remaining {
 public:
  explicit Remaining(KeyMap<CubeBits> cubes) : cubes_(std::move(cubes)) {}

  /// Covers all of them.
  std::vector<CellBlockBox> boxes() {
    std::vector<CellBlockBox> boxes;
    for (const std::uint64_t key : cubes_.sortedKeys()) {
      const Int3 cube = unpackKey(key);
      const CubeBits& bits = *cubes_.find(key);
      for (std::size_t z = 0; z < 8; ++z) {
        while (bits[z] != 0) {
          const int bit = __builtin_ctzll(bits[z]);
          boxes.push_back(grown({8 * cube.x + (bit & 7), 8 * cube.y + (bit >> 3),
                                 8 * cube.z + static_cast<std::int32_t>(z)}));
          const CellBlockBox& box = boxes.back();
          forEachWord(box.low, box.size, [](std::uint64_t* word, std::uint64_t mask) {
            *word &= ~mask;
            return true;
          });
        }
      }
    }
    return boxes;
  }

 private:
  CellBlockBox grown(const Int3& low) {
    CellBlockBox box{low, {1, 1, 1}};
    const auto grow = [&](std::size_t axis) {
      for (;; ++box.size[axis]) {
        Int3 next = low, size = box.size;
        next[axis] += size[axis];
        size[axis] = 1;
        const bool is_there =
            forEachWord(next, size, [](const std::uint64_t* word, std::uint64_t mask) {
              return word != nullptr && (*word & mask) == mask;
            });
        if (!is_there) return;
      }
    };
    for (std::size_t axis = 0; axis < 3; ++axis) grow(axis);
    return box;
  }

  /// Calls visit(word, bits of it) for the words of the cubes that a box meets, with null where
  /// there is no cube, as long as that gives true. \return was that always
  template <typename Visit>
  bool forEachWord(const Int3& low, const Int3& size, Visit&& visit) {
    const Int3 last{low.x + size.x - 1, low.y + size.y - 1, low.z + size.z - 1};
    Int3 cube;
    for (cube.z = low.z >> 3; cube.z <= last.z >> 3; ++cube.z) {
      for (cube.y = low.y >> 3; cube.y <= last.y >> 3; ++cube.y) {
        for (cube.x = low.x >> 3; cube.x <= last.x >> 3; ++cube.x) {
          std::int32_t from[3], to[3];
          for (std::size_t k = 0; k < 3; ++k) {
            from[k] = std::max(low[k] - 8 * cube[k], 0);
            to[k] = std::min(last[k] - 8 * cube[k], 7);
          }
          const std::uint64_t row = (0xffu >> (7 - to[0] + from[0])) << from[0];
          std::uint64_t mask = 0;
          for (std::int32_t y = from[1]; y <= to[1]; ++y) mask |= row << (8 * y);
          CubeBits* bits = cubes_.find(packKey(cube));
          for (std::int32_t z = from[2]; z <= to[2]; ++z) {
            if (!visit(bits == nullptr ? nullptr : &(*bits)[static_cast<std::size_t>(z)], mask))
              return false;
          }
        }
      }
    }
    return true;
  }

  KeyMap<CubeBits> cubes_;
};

}  // namespace

std::size_t SpaceCells::count() const {
  std::size_t count = regions.size() * kRegionSide * kRegionSide * kRegionSide;
  for (const CubeBits& cube : cubes.values()) {
    for (const std::uint64_t word : cube) {
      count += static_cast<std::size_t>(__builtin_popcountll(word));
    }
  }
  return count;
}

SpaceCells spaceCells(const UnknownSpace& space, CellState state, const SpaceBox& box,
                      const std::vector<Cuboid>& occupied, double cell) {
  return Collector(space, state, box, cell).collect(occupied);
}

std::vector<CellBlockBox> mergeToBoxes(const SpaceCells& cells) {
  KeyMap<CubeBits> regions;
  for (const std::uint64_t key : cells.regions.keys()) {
    const Int3 at = unpackKey(key);
    regions[packKey(Int3{at.x >> 3, at.y >> 3, at.z >> 3})][static_cast<std::size_t>(at.z & 7)] |=
        std::uint64_t{1} << (8 * (at.y & 7) + (at.x & 7));
  }
  std::vector<CellBlockBox> boxes = Remaining(std::move(regions)).boxes();
  for (CellBlockBox& box : boxes) {
    for (std::size_t k = 0; k < 3; ++k) {
      box.low[k] *= kRegionSide;
      box.size[k] *= kRegionSide;
    }
  }
  const std::vector<CellBlockBox> others = Remaining(cells.cubes).boxes();
  boxes.insert(boxes.end(), others.begin(), others.end());
  return boxes;
}

}  // namespace planar_mapping::detail
