// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "file/bit_coder.h"
#include "store/key_map.h"

namespace planar_mapping::detail {

/// 8 x 8 cells of a plane or 4 x 4 x 4 cells of space; a cell has the value 0, 1 or 2.
struct LatticeBundle {
  Int3 at;                 ///< in bundles; z = 0 for planes
  std::uint64_t ones = 0;  ///< bit 8 b + a, or 16 z + 4 y + x
  std::uint64_t twos = 0;
};

/// What a file stands for, to be weighed against its bytes.
struct LatticeCount {
  std::size_t regions = 0;
  std::size_t bundles = 0;  ///< that take memory of their own: in space, mixed ones
};

/// So many regions (1) and bundles a byte of a file may stand for.
constexpr std::size_t kBundlesPerByte = 8;

/// Codes lattices of cells (docs/file_format.md, "Lattices"): which regions of 8 x 8 (x 8) bundles
/// there are, a 2-bit label a bundle, the cells of those that are mixed; every decision by the
/// neighbours that are known already. What was learnt is kept from one lattice to the next.
class LatticeCoder {
 public:
  /// \param dimensions 2 or 3
  /// \param with_twos  can cells be 2?
  LatticeCoder(int dimensions, bool with_twos);

  /// Sorts bundles into the order of the file.
  static void sort(int dimensions, std::vector<LatticeBundle>& bundles);
  /// Codes bundles that are sorted and have a cell each; when reading, fills the list.
  /// \throws Error
  void code(BitCoder& coder, std::vector<LatticeBundle>& bundles, LatticeCount& count);
  void forget();

 private:
  struct Region;
  class Grid;
  void codeRegions(BitCoder& coder, std::vector<Int3>& regions);
  void codeLabels(BitCoder& coder, Grid& grid, Region& region);
  void codeCells(BitCoder& coder, Grid& grid, Region& region, std::size_t bundle);

  const int dimensions_;
  const bool with_twos_;
  MixedBit labels_;
  MixedBit cells_;
  AdaptiveBit uniform_;
  SymbolModel<2> uniform_label_;
  NumberModel count_, corner_, step_;
  AdaptiveBit next_, same_row_, same_slab_;
};

}  // namespace planar_mapping::detail
