// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/belief_coder.h"

#include "store/belief.h"
#include "store/cell_layer.h"
#include "store/key_map.h"

namespace planar_mapping::detail {
namespace {

constexpr int kBits = 5;
static_assert(kCertain < 1 << kBits);
constexpr std::uint32_t kValues = kCertain + 1;

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
                                  const std::uint32_t* before, std::uint32_t around) {
  const std::uint32_t left = before[0], back = before[1], diagonal = before[2], right = before[3];
  std::uint32_t all = 0;
  for (std::uint32_t i = 0; i < 4; ++i) all |= coarse(before[i]) << (2 * i);
  const std::uint32_t middle = left != 0 && back != 0 ? (left + back) / 2 : left | back;
  const std::uint32_t doubt = kCertain - belief;
  std::uint32_t node = 1;  // the bits so far below a one
  for (int i = kBits - 1; i >= 0; --i) {
    std::uint32_t context[] = {left,
                               back,
                               middle,
                               all,
                               kValues * left + back,
                               kValues * diagonal + right,
                               around,
                               4 * middle + (around & 3u)};
    for (std::uint32_t& c : context) c = node + 32 * c;
    const auto set = static_cast<std::size_t>(kBits - 1 - i);
    const MixedBit::Selectors selected{set, set + kBits * (coarse(left) + 4 * coarse(back))};
    node = 2 * node + (bits_.code(coder, (doubt >> i & 1u) != 0, context, selected) ? 1u : 0u);
  }
  const std::uint32_t coded = node - (1u << kBits);
  if (coded >= kCertain) coder.fail("gives an occupied cell no belief");
  return static_cast<std::uint8_t>(kCertain - coded);
}

void BeliefCoder::code(BitCoder& coder, const std::vector<LatticeBundle>& bundles,
                       std::vector<std::uint8_t>& beliefs) {
  KeyMap<std::uint8_t> known;  // by cell; 0 until it is coded
  forEachCell(bundles, is_flat_, [&](const Int3& c) { known.insert(packKey(c)); });
  beliefs.resize(known.size());
  const auto fits = [](std::int32_t v) { return v >= -kLatticeLimit && v < kLatticeLimit; };
  const auto find = [&](const Int3& c) -> const std::uint8_t* {
    return fits(c.x) && fits(c.y) && fits(c.z) ? known.find(packKey(c)) : nullptr;
  };
  std::size_t next = 0;
  forEachCell(bundles, is_flat_, [&](const Int3& c) {
    const auto at = [&](std::int32_t dx, std::int32_t dy, std::int32_t dz) -> std::uint32_t {
      const std::uint8_t* found = find({c.x + dx, c.y + dy, c.z + dz});
      return found != nullptr ? *found : 0;
    };
    const std::uint32_t before[4] = {at(-1, 0, 0), at(0, -1, 0),
                                     is_flat_ ? at(-1, -1, 0) : at(0, 0, -1), at(1, -1, 0)};
    const Int3 beside[8] = {{1, 0, 0},
                            {0, 1, 0},
                            {-1, 0, 0},
                            {0, -1, 0},
                            is_flat_ ? Int3{-1, 1, 0} : Int3{0, 0, 1},
                            is_flat_ ? Int3{1, 1, 0} : Int3{0, 0, -1},
                            {2, 0, 0},
                            {0, 2, 0}};
    std::uint32_t around = 0;
    for (std::uint32_t k = 0; k < 8; ++k) {
      const Int3& d = beside[k];
      around |= (find({c.x + d.x, c.y + d.y, c.z + d.z}) != nullptr ? 1u : 0u) << k;
    }
    std::uint8_t& belief = beliefs[next++];
    belief = codeOne(coder, belief, before, around);
    known[packKey(c)] = belief;
  });
}

}  // namespace planar_mapping::detail
