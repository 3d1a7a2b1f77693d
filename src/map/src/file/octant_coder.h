// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "file/bit_coder.h"
#include "file/lattice_coder.h"

namespace planar_mapping::detail {

/// Which eighths of non-planar cells hold points (docs/file_format.md, "Non-planar cells"). Points
/// lie on surfaces, which go on in the next cells and in the other eighths of this one.
class OctantCoder {
 public:
  /// \param blocks  the cells, all of them known
  /// \param beliefs of the cells, in their order, known
  /// \param octants one value for each of them
  /// \throws Error if a cell that is read has no eighth
  void code(BitCoder& coder, const std::vector<LatticeBundle>& blocks,
            const std::vector<std::uint8_t>& beliefs, std::vector<std::uint8_t>& octants);
  void forget() { eighths_.forget(); }

 private:
  struct Around;
  std::uint8_t codeOne(BitCoder& coder, std::uint32_t octants, std::uint32_t belief,
                       const Around& around);

  MixedBit eighths_{9, 4096, {16, 64}};
};

}  // namespace planar_mapping::detail
