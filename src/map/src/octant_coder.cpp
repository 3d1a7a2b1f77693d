// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "octant_coder.h"

#include <algorithm>
#include <array>

#include "cell_layer.h"
#include "key_map.h"

namespace planar_mapping::detail {

void codeOctants(BitCoder& coder, const std::vector<LatticeBundle>& blocks,
                 std::vector<std::uint8_t>& octants) {
  KeyMap<std::uint8_t> known;  // by cell; 0 until it is coded
  for (const LatticeBundle& b : blocks) {
    for (std::uint64_t bits = b.ones; bits != 0; bits &= bits - 1) {
      known.insert(packKey(CellLayer::cellOf(b.at, __builtin_ctzll(bits))));
    }
  }
  constexpr std::size_t kContexts = 2048;
  MixedBit eighths(7, kContexts, 1);
  std::size_t next = 0;
  for (const LatticeBundle& b : blocks) {
    for (std::uint64_t bits = b.ones; bits != 0; bits &= bits - 1) {
      const Int3 c = CellLayer::cellOf(b.at, __builtin_ctzll(bits));
      // The cells around this one, and their eighths.
      std::array<std::uint32_t, 27> is_there{}, there_are{};
      for (std::int32_t k = 0; k < 27; ++k) {
        const Int3 at{c.x + k % 3 - 1, c.y + k / 3 % 3 - 1, c.z + k / 9 - 1};
        const auto fits = [](std::int32_t v) { return v >= -kLatticeLimit && v < kLatticeLimit; };
        if (!fits(at.x) || !fits(at.y) || !fits(at.z)) continue;
        const std::uint8_t* found = known.find(packKey(at));
        is_there[static_cast<std::size_t>(k)] = found != nullptr ? 1 : 0;
        there_are[static_cast<std::size_t>(k)] = found != nullptr ? *found : 0;
      }
      const std::uint32_t left = there_are[12], back = there_are[10], below = there_are[4];
      std::uint8_t& value = octants[next++];
      std::uint32_t node = 1;  // the bits so far below a one
      for (std::uint32_t i = 0; i < 8; ++i) {
        // The eighths on the other sides of this one's faces, in this cell or the one before.
        const std::uint32_t own = node & ((1u << i) - 1);
        const std::uint32_t x = (i & 1u) != 0 ? own >> (i ^ 1u) & 1u : left >> (i ^ 1u) & 1u;
        const std::uint32_t y = (i & 2u) != 0 ? own >> (i ^ 2u) & 1u : back >> (i ^ 2u) & 1u;
        const std::uint32_t z = (i & 4u) != 0 ? own >> (i ^ 4u) & 1u : below >> (i ^ 4u) & 1u;
        const std::uint32_t there =
            (left != 0 ? 1u : 0u) | (back != 0 ? 2u : 0u) | (below != 0 ? 4u : 0u);
        // The cells beyond this eighth's outer faces, edges and corner.
        const int dx = (i & 1u) != 0 ? 1 : -1;
        const int dy = (i & 2u) != 0 ? 3 : -3;
        const int dz = (i & 4u) != 0 ? 9 : -9;
        const auto has = [&](int step) { return is_there[static_cast<std::size_t>(13 + step)]; };
        const std::uint32_t nx = has(dx), ny = has(dy), nz = has(dz);
        const std::uint32_t beyond = nx | ny << 1u | nz << 2u;
        const std::uint32_t corner =
            has(dx + dy) | has(dx + dz) << 1u | has(dy + dz) << 2u | has(dx + dy + dz) << 3u;
        const auto ones = static_cast<std::uint32_t>(__builtin_popcount(own));
        const std::uint32_t faces = x | y << 1u | z << 2u;
        const std::uint32_t context[7] = {
            own | 1u << i,
            i | faces << 3u | there << 6u,
            i | left << 3u,
            i | below << 3u,
            beyond | corner << 3u | faces << 7u,
            i | beyond << 3u | faces << 6u | std::min(ones, 2u) << 9u,
            std::min(ones, 3u) | (x + y + z) << 2u | (nx + ny + nz) << 4u};
        const bool bit = eighths.code(coder, (value >> i & 1u) != 0, context, 0);
        node = own | (bit ? 1u << i : 0u) | 2u << i;
      }
      value = static_cast<std::uint8_t>(node);
      if (value == 0) coder.fail("has a cell that holds no point");
      known[packKey(c)] = value;
    }
  }
}

}  // namespace planar_mapping::detail
