// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "depth_image.h"
#include "key_map.h"

namespace planar_mapping::detail {

/// 8 x 8 x 8 cells: word z, bit 8 y + x.
using CubeBits = std::array<std::uint64_t, 8>;

/// Which cells of the world grid are hidden behind a surface, and which were seen free (the paper,
/// III-F, Fig. 5c). A cell once seen free is never unknown again, in whatever order frames come;
/// that is why free cells are remembered as well.
class UnknownSpace {
 public:
  struct Cube {
    CubeBits unknown{};
    CubeBits free{};
  };

  /// Judges the cells in the frustum of an image, up to \p max_range, by its depths.
  void integrate(const DepthImage& image, double cell, double max_range);
  bool isUnknown(const Int3& cell) const;

  std::size_t cubes() const { return states_.size(); }
  std::uint64_t key(std::size_t i) const { return states_.key(i); }
  /// Bits of cube i, which may be stored as a mere word.
  Cube cube(std::size_t i) const;
  /// Of a file; merges with what is there.
  void addFree(const Int3& cube, const CubeBits& bits) { set(packKey(cube), bits, true); }
  void addUnknown(const Int3& cube, const CubeBits& bits) { set(packKey(cube), bits, false); }
  std::size_t memoryBytes() const {
    return states_.memoryBytes() + cubes_.capacity() * sizeof(Cube) +
           spare_.capacity() * sizeof(std::uint32_t);
  }

 private:
  static constexpr std::uint32_t kNothing = 0;  ///< never judged
  static constexpr std::uint32_t kAllFree = 1;
  static constexpr std::uint32_t kAllUnknown = 2;
  static constexpr std::uint32_t kFirstCube = 3;  ///< above: position in cubes_

  class Walk;
  bool isAllFree(std::uint64_t key) const {
    const std::uint32_t* state = states_.find(key);
    return state != nullptr && *state == kAllFree;
  }
  /// Of a cube that is not all free.
  CubeBits freeBits(std::uint64_t key) const;
  void set(std::uint64_t key, const CubeBits& bits, bool free);
  void setAll(std::uint64_t key, bool free);
  void release(std::uint32_t state) {
    if (state >= kFirstCube) spare_.push_back(state - kFirstCube);
  }

  KeyMap<std::uint32_t> states_;  ///< by cell >> 3
  std::vector<Cube> cubes_;
  std::vector<std::uint32_t> spare_;
};

/// The unknown cells whose centre no cuboid occupies.
/// \param cell side of a cell, metres
KeyMap<CubeBits> unknownCells(const UnknownSpace& space, const std::vector<Cuboid>& occupied,
                              double cell);

/// Box of unknown cells, low and size in cells.
struct CellBlockBox {
  Int3 low;
  Int3 size;
};
/// Covers the cells of the cubes exactly with disjoint boxes, greedily along x, y, z.
std::vector<CellBlockBox> mergeToBoxes(const KeyMap<CubeBits>& cubes);

}  // namespace planar_mapping::detail
