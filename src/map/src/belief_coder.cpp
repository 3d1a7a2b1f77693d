// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "belief_coder.h"

#include "belief.h"
#include "cell_layer.h"
#include "key_map.h"

namespace planar_mapping::detail {
namespace {

constexpr int kBits = 5;
static_assert(kCertain < 1 << kBits);

/// Calls visit(cell) for every cell, in the order of the file.
template <typename Visit>
void forEachCell(const std::vector<LatticeBundle>& bundles, bool is_flat, Visit&& visit) {
  for (const LatticeBundle& b : bundles) {
    for (std::uint64_t bits = b.ones; bits != 0; bits &= bits - 1) {
      const int bit = __builtin_ctzll(bits);
      visit(is_flat ? Int3{8 * b.at.x + (bit & 7), 8 * b.at.y + (bit >> 3), 0}
                    : CellLayer::cellOf(b.at, bit));
    }
  }
}

/// Nothing, little, much or certain.
std::uint32_t coarse(std::uint32_t belief) {
  return belief == 0 ? 0 : belief == kCertain ? 3 : 4 * belief >= 3 * kCertain ? 2 : 1;
}

}  // namespace

std::uint8_t BeliefCoder::codeOne(BitCoder& coder, std::uint32_t belief,
                                  const std::uint32_t* before) {
  const std::uint32_t left = before[0], back = before[1];
  std::uint32_t all = 0;
  for (std::uint32_t i = 0; i < 4; ++i) all |= coarse(before[i]) << (2 * i);
  const std::uint32_t middle = left != 0 && back != 0 ? (left + back) / 2 : left | back;
  const std::uint32_t doubt = kCertain - belief;
  std::uint32_t node = 1;  // the bits so far below a one
  for (int i = kBits - 1; i >= 0; --i) {
    const std::uint32_t context[4] = {node + 32 * left, node + 32 * back, node + 32 * middle,
                                      node + 32 * all};
    const auto set = static_cast<std::size_t>(kBits - 1 - i);
    node = 2 * node + (bits_.code(coder, (doubt >> i & 1u) != 0, context, set) ? 1u : 0u);
  }
  const std::uint32_t coded = node - (1u << kBits);
  if (coded >= kCertain) coder.fail("gives an occupied cell no belief");
  return static_cast<std::uint8_t>(kCertain - coded);
}

void BeliefCoder::code(BitCoder& coder, const std::vector<LatticeBundle>& bundles,
                       std::vector<std::uint8_t>& beliefs) {
  KeyMap<std::uint8_t> known;  // by cell
  std::size_t count = 0;
  forEachCell(bundles, is_flat_, [&](const Int3&) { ++count; });
  beliefs.resize(count);
  const auto at = [&](const Int3& c) -> std::uint32_t {
    if (c.x < -kLatticeLimit || c.y < -kLatticeLimit || c.z < -kLatticeLimit) return 0;
    if (c.x >= kLatticeLimit) return 0;
    const std::uint8_t* found = known.find(packKey(c));
    return found != nullptr ? *found : 0;
  };
  std::size_t next = 0;
  forEachCell(bundles, is_flat_, [&](const Int3& c) {
    const std::uint32_t before[4] = {at({c.x - 1, c.y, c.z}), at({c.x, c.y - 1, c.z}),
                                     is_flat_ ? at({c.x - 1, c.y - 1, 0}) : at({c.x, c.y, c.z - 1}),
                                     at({c.x + 1, c.y - 1, c.z})};
    std::uint8_t& belief = beliefs[next++];
    belief = codeOne(coder, belief, before);
    known[packKey(c)] = belief;
  });
}

}  // namespace planar_mapping::detail
