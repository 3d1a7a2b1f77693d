// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/octant_coder.h"

#include <algorithm>
#include <array>

#include "store/belief.h"
#include "store/cell_layer.h"
#include "store/key_map.h"

namespace planar_mapping::detail {

/// The 27 cells around one and itself; the one at (dx, dy, dz) is 13 + dx + 3 dy + 9 dz.
struct OctantCoder::Around {
  std::array<std::uint32_t, 27> exists{};
  std::array<std::uint32_t, 27> octants{};  ///< 0 until they are coded

  /// Whether the eighth at (dx, dy, dz) from the eighth \p i of the middle cell is known to hold
  /// points; \p own are the eighths of that cell that are known.
  std::uint32_t isSet(std::uint32_t i, std::uint32_t own, int dx, int dy, int dz) const {
    const int x = static_cast<int>(i & 1u) + dx;
    const int y = static_cast<int>(i >> 1u & 1u) + dy;
    const int z = static_cast<int>(i >> 2u) + dz;
    const int cell = 13 + (x >> 1) + 3 * (y >> 1) + 9 * (z >> 1);
    const std::uint32_t set = cell == 13 ? own : octants[static_cast<std::size_t>(cell)];
    return set >> ((x & 1) | (y & 1) << 1 | (z & 1) << 2) & 1u;
  }
};

std::uint8_t OctantCoder::codeOne(BitCoder& coder, std::uint32_t octants, std::uint32_t belief,
                                  const Around& around) {
  const auto exists = [&](int step) { return around.exists[static_cast<std::size_t>(13 + step)]; };
  std::uint32_t cells = 0;
  for (const std::uint32_t e : around.exists) cells += e;
  const std::uint32_t before = exists(-1) | exists(-3) << 1u | exists(-9) << 2u;
  const std::size_t crowd = std::min((cells - 1) / 3, 3u);
  std::uint32_t own = 0;
  for (std::uint32_t i = 0; i < 8; ++i) {
    const auto set = [&](int dx, int dy, int dz) { return around.isSet(i, own, dx, dy, dz); };
    const std::uint32_t faces = set(-1, 0, 0) | set(0, -1, 0) << 1u | set(0, 0, -1) << 2u;
    const std::uint32_t inner = faces | set(-1, -1, 0) << 3u | set(-1, 0, -1) << 4u |
                                set(0, -1, -1) << 5u | set(-1, -1, -1) << 6u;
    const std::uint32_t outer = set(1, -1, 0) | set(1, 0, -1) << 1u | set(0, 1, -1) << 2u |
                                set(1, 1, -1) << 3u | set(-1, 1, -1) << 4u | set(1, -1, -1) << 5u;
    const std::uint32_t far = set(-2, 0, 0) | set(0, -2, 0) << 1u | set(0, 0, -2) << 2u;
    // The cells beyond this eighth's outer faces, edges and corner.
    const int dx = (i & 1u) != 0 ? 1 : -1;
    const int dy = (i & 2u) != 0 ? 3 : -3;
    const int dz = (i & 4u) != 0 ? 9 : -9;
    const std::uint32_t beyond = exists(dx) | exists(dy) << 1u | exists(dz) << 2u;
    const std::uint32_t edges = exists(dx + dy) | exists(dx + dz) << 1u | exists(dy + dz) << 2u |
                                exists(dx + dy + dz) << 3u;
    const auto count = [](std::uint32_t bits) {
      return static_cast<std::uint32_t>(__builtin_popcount(bits));
    };
    const std::uint32_t ones = std::min(count(own), 3u);
    const std::uint32_t context[] = {own | 1u << i,
                                     i | faces << 3u | before << 6u,
                                     beyond | edges << 3u | faces << 7u,
                                     i | beyond << 3u | faces << 6u | std::min(ones, 2u) << 9u,
                                     belief | ones << 5u | i << 7u,
                                     inner | i << 7u,
                                     outer | faces << 6u | ones << 9u,
                                     far | faces << 3u | i << 6u | beyond << 9u,
                                     std::min(count(inner) + count(outer), 7u) | ones << 3u |
                                         std::min(cells / 2, 7u) << 5u | count(faces) << 8u |
                                         (2 * belief > kCertain ? 1u : 0u) << 10u};
    const bool bit = eighths_.code(coder, (octants >> i & 1u) != 0, context,
                                   {ones | crowd << 2u, i | faces << 3u});
    own |= (bit ? 1u : 0u) << i;
  }
  if (own == 0) coder.fail("has a cell that holds no point");
  return static_cast<std::uint8_t>(own);
}

void OctantCoder::code(BitCoder& coder, const std::vector<LatticeBundle>& blocks,
                       const std::vector<std::uint8_t>& beliefs,
                       std::vector<std::uint8_t>& octants) {
  KeyMap<std::uint8_t> known;  // by cell
  const auto forEachCell = [&](auto&& visit) {
    for (const LatticeBundle& b : blocks) {
      for (std::uint64_t bits = b.ones; bits != 0; bits &= bits - 1) {
        visit(CellLayer::cellOf(b.at, __builtin_ctzll(bits)));
      }
    }
  };
  forEachCell([&](const Int3& c) { known.insert(packKey(c)); });
  octants.resize(known.size());
  const auto fits = [](std::int32_t v) { return v >= -kLatticeLimit && v < kLatticeLimit; };
  std::size_t next = 0;
  forEachCell([&](const Int3& c) {
    Around around;
    for (std::int32_t k = 0; k < 27; ++k) {
      const Int3 at{c.x + k % 3 - 1, c.y + k / 3 % 3 - 1, c.z + k / 9 - 1};
      if (!fits(at.x) || !fits(at.y) || !fits(at.z)) continue;
      const std::uint8_t* found = known.find(packKey(at));
      if (found == nullptr) continue;
      around.exists[static_cast<std::size_t>(k)] = 1;
      around.octants[static_cast<std::size_t>(k)] = *found;
    }
    octants[next] = codeOne(coder, octants[next], beliefs[next], around);
    known[packKey(c)] = octants[next++];
  });
}

}  // namespace planar_mapping::detail
