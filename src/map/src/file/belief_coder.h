// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "file/bit_coder.h"
#include "file/lattice_coder.h"

namespace planar_mapping::detail {

/// Beliefs of cells (docs/file_format.md, "Beliefs"): mostly like those of the cells beside them.
class BeliefCoder {
 public:
  /// \param dimensions of the cells, 2 or 3
  explicit BeliefCoder(int dimensions) : is_flat_(dimensions == 2) {}
  /// \param bundles the cells, all of them known
  /// \param beliefs one for each of them, in their order
  /// \throws Error if a belief that is read is none
  void code(BitCoder& coder, const std::vector<LatticeBundle>& bundles,
            std::vector<std::uint8_t>& beliefs);
  void forget() { bits_.forget(); }

 private:
  /// \param before beliefs of four cells that are known
  /// \param around which of eight cells there are
  std::uint8_t codeOne(BitCoder& coder, std::uint32_t belief, const std::uint32_t* before,
                       std::uint32_t around);

  bool is_flat_;
  MixedBit bits_{8, 32 * 18 * 18, {5, 5 * 16}};
};

}  // namespace planar_mapping::detail
