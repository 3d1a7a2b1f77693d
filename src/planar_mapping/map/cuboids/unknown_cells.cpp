// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "planar_mapping/map/store/unknown_space.h"

namespace planar_mapping::detail {
namespace {

/// Clears the cells of a cube whose centre the cuboid contains.
void clearOccupied(const Int3& cube, const Cuboid& cuboid, double cell, CubeBits& bits) {
  const Matrix3 to_local = cuboid.orientation.conjugate().toRotationMatrix();
  const Vector3 half = 0.5 * cuboid.size;
  const Vector3 middle = 8.0 * cell * (Vector3(cube.x, cube.y, cube.z) + Vector3::Constant(0.5));
  const Vector3 local = to_local * (middle - cuboid.center);
  const double radius = 4.0 * std::sqrt(3.0) * cell;
  const double rounding = 1e-9 * cell;
  if (((local.cwiseAbs() - half).array() > radius).any()) return;
  for (std::size_t z = 0; z < 8; ++z) {
    for (std::uint64_t left = bits[z]; left != 0; left &= left - 1) {
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

/// Cells left to be put into boxes.
class Remaining {
 public:
  explicit Remaining(const KeyMap<CubeBits>& cubes) : cubes_(cubes) {}

  bool at(const Int3& c) const {
    const CubeBits* bits = cubes_.find(packKey(Int3{c.x >> 3, c.y >> 3, c.z >> 3}));
    return bits != nullptr && (((*bits)[static_cast<std::size_t>(c.z & 7)] >> bitOf(c)) & 1u) != 0;
  }
  bool all(const Int3& low, const Int3& size) const {
    for (std::int32_t z = low.z; z < low.z + size.z; ++z) {
      for (std::int32_t y = low.y; y < low.y + size.y; ++y) {
        for (std::int32_t x = low.x; x < low.x + size.x; ++x) {
          if (!at({x, y, z})) return false;
        }
      }
    }
    return true;
  }
  void clear(const Int3& low, const Int3& size) {
    const Int3 last{low.x + size.x - 1, low.y + size.y - 1, low.z + size.z - 1};
    forEachPlace(low, last, [&](const Int3& c) {
      CubeBits* bits = cubes_.find(packKey(Int3{c.x >> 3, c.y >> 3, c.z >> 3}));
      (*bits)[static_cast<std::size_t>(c.z & 7)] &= ~(std::uint64_t{1} << bitOf(c));
    });
  }
  const CubeBits& bits(std::uint64_t key) const { return *cubes_.find(key); }

 private:
  static int bitOf(const Int3& c) { return 8 * (c.y & 7) + (c.x & 7); }
  KeyMap<CubeBits> cubes_;
};

}  // namespace

KeyMap<CubeBits> spaceCells(const UnknownSpace& space, CellState state, const SpaceBox& box,
                            const std::vector<Cuboid>& occupied, double cell) {
  // Cells with their middles in the box.
  const auto first = [&](double at) { return std::ceil(at / cell - 0.5); };
  const auto last = [&](double at) { return std::floor(at / cell - 0.5); };
  const Vector3 lowest = box.low.unaryExpr(first), highest = box.high.unaryExpr(last);
  KeyMap<CubeBits> cubes;
  space.forEachBlock([&](const Int3& at, const UnknownSpace::Block& block) {
    std::uint64_t cells = state == CellState::Free  ? block.free
                          : space.isUnseenUnknown() ? ~block.free
                                                    : block.unknown;
    if (cells == 0) return;
    const Vector3 corner = 4.0 * Vector3(at.x, at.y, at.z);
    if ((corner.array() > highest.array()).any() || (corner.array() + 3.0 < lowest.array()).any())
      return;
    if ((corner.array() < lowest.array()).any() || (corner.array() + 3.0 > highest.array()).any()) {
      forEachBit(cells, [&](std::size_t bit) {
        const Vector3 c = corner + Vector3(bit & 3u, bit >> 2u & 3u, bit >> 4u);
        const bool inside =
            (c.array() >= lowest.array()).all() && (c.array() <= highest.array()).all();
        if (!inside) cells &= ~(std::uint64_t{1} << bit);
      });
      if (cells == 0) return;
    }
    CubeBits& bits = cubes[packKey(Int3{at.x >> 1, at.y >> 1, at.z >> 1})];
    for (int slice = 0; slice < 4; ++slice) {
      std::uint64_t rows = 0;
      for (int row = 0; row < 4; ++row) {
        rows |= ((cells >> (16 * slice + 4 * row)) & 0xfu) << (8 * row);
      }
      bits[static_cast<std::size_t>(4 * (at.z & 1) + slice)] |=
          rows << (32 * (at.y & 1) + 4 * (at.x & 1));
    }
  });
  if (cubes.empty()) return cubes;
  constexpr double kLimit = kLatticeLimit / 8;
  for (const Cuboid& cuboid : occupied) {
    const Vector3 half = reach(cuboid);
    const Vector3 low =
        ((cuboid.center - half) / (8.0 * cell)).array().floor().max(-kLimit).min(kLimit - 1);
    const Vector3 high =
        ((cuboid.center + half) / (8.0 * cell)).array().floor().max(-kLimit).min(kLimit - 1);
    const double count = (high - low + Vector3::Ones()).prod();
    if (count > static_cast<double>(cubes.size())) {
      for (std::size_t i = 0; i < cubes.size(); ++i) {
        clearOccupied(unpackKey(cubes.key(i)), cuboid, cell, cubes.value(i));
      }
      continue;
    }
    forEachPlace(toInt3(low), toInt3(high), [&](const Int3& cube) {
      CubeBits* bits = cubes.find(packKey(cube));
      if (bits != nullptr) clearOccupied(cube, cuboid, cell, *bits);
    });
  }
  return cubes;
}

std::vector<CellBlockBox> mergeToBoxes(const KeyMap<CubeBits>& cubes) {
  Remaining remaining(cubes);
  std::vector<CellBlockBox> boxes;
  for (const std::uint64_t key : cubes.sortedKeys()) {
    const Int3 cube = unpackKey(key);
    for (std::size_t z = 0; z < 8; ++z) {
      while (remaining.bits(key)[z] != 0) {
        const int bit = __builtin_ctzll(remaining.bits(key)[z]);
        CellBlockBox box;
        box.low = {8 * cube.x + (bit & 7), 8 * cube.y + (bit >> 3),
                   8 * cube.z + static_cast<std::int32_t>(z)};
        box.size = {1, 1, 1};
        while (remaining.at({box.low.x + box.size.x, box.low.y, box.low.z})) ++box.size.x;
        while (remaining.all({box.low.x, box.low.y + box.size.y, box.low.z}, {box.size.x, 1, 1})) {
          ++box.size.y;
        }
        while (remaining.all({box.low.x, box.low.y, box.low.z + box.size.z},
                             {box.size.x, box.size.y, 1})) {
          ++box.size.z;
        }
        remaining.clear(box.low, box.size);
        boxes.push_back(box);
      }
    }
  }
  return boxes;
}

}  // namespace planar_mapping::detail
