// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "raster_cleanup.h"

#include <array>
#include <cstddef>

namespace planar_mapping::detail {
namespace {

/// Passes over the raster; hardly anything changes after the second.
constexpr int kPasses = 4;

/// Neighbours of a cell in the order of the bits of a neighbourhood.
constexpr std::array<std::array<int, 2>, 8> kAround = {
    {{-1, -1}, {0, -1}, {1, -1}, {-1, 0}, {1, 0}, {-1, 1}, {0, 1}, {1, 1}}};

/// 3 x concave + convex for the corner between four cells.
constexpr int cornerScore(bool cell, bool beside, bool over, bool diagonal) {
  const int count = cell + beside + over + diagonal;
  if (count == 1) return 1;
  if (count == 3) return 3;
  if (count == 2 && cell == diagonal) return 2;  // two cells touch at the corner only
  return 0;
}

constexpr int cellScore(unsigned around, bool cell) {
  const auto bit = [around](unsigned i) { return (around >> i & 1u) != 0; };
  return cornerScore(cell, bit(3), bit(1), bit(0)) + cornerScore(cell, bit(4), bit(1), bit(2)) +
         cornerScore(cell, bit(3), bit(6), bit(5)) + cornerScore(cell, bit(4), bit(6), bit(7));
}

/// What occupying a cell adds to the score, by its neighbourhood.
constexpr std::array<signed char, 256> makeGains() {
  std::array<signed char, 256> gains{};
  for (unsigned around = 0; around < 256; ++around) {
    gains[around] = static_cast<signed char>(cellScore(around, true) - cellScore(around, false));
  }
  return gains;
}
constexpr std::array<signed char, 256> kGains = makeGains();

class BorderSimplifier {
 public:
  BorderSimplifier(CellMask& mask, const std::uint8_t* quarters, bool fill)
      : mask_(mask),
        quarters_(quarters),
        fill_(fill),
        pitch_(mask.width + 2),
        grid_(static_cast<std::size_t>(pitch_) * (mask.height + 2), 0),
        relied_upon_(grid_) {
    for (std::int32_t b = 0; b < mask.height; ++b) {
      for (std::int32_t a = 0; a < mask.width; ++a) grid_[at(a, b)] = mask.at(a, b);
    }
  }

  void run() {
    for (int pass = 0; pass < kPasses; ++pass) {
      bool changed = false;
      for (std::int32_t b = 0; b < mask_.height; ++b) {
        for (std::int32_t a = 0; a < mask_.width; ++a) changed |= visit(a, b);
      }
      if (!changed) break;
    }
    for (std::int32_t b = 0; b < mask_.height; ++b) {
      for (std::int32_t a = 0; a < mask_.width; ++a) {
        mask_.cells[static_cast<std::size_t>(b) * mask_.width + a] = grid_[at(a, b)];
      }
    }
  }

 private:
  std::size_t at(std::int32_t a, std::int32_t b) const {
    return static_cast<std::size_t>(b + 1) * pitch_ + static_cast<std::size_t>(a + 1);
  }

  bool visit(std::int32_t a, std::int32_t b) {
    const std::size_t i = at(a, b);
    unsigned around = 0;
    for (unsigned k = 0; k < 8; ++k) {
      around |= static_cast<unsigned>(grid_[at(a + kAround[k][0], b + kAround[k][1])]) << k;
    }
    if (around == 0 || around == 0xFF) {
      if (around == 0xFF && !grid_[i] && fill_) grid_[i] = 1;
      return false;
    }
    if (grid_[i]) return kGains[around] > 0 && takeAway(a, b);
    const bool between =
        (around >> 3 & around >> 4 & 1u) != 0 || (around >> 1 & around >> 6 & 1u) != 0;
    if (!fill_ || !between || kGains[around] >= 0) return false;
    grid_[i] = 1;
    return true;
  }

  bool takeAway(std::int32_t a, std::int32_t b) {
    const std::size_t i = at(a, b);
    if (!quarters_ || relied_upon_[i]) return false;
    const unsigned q = quarters_[static_cast<std::size_t>(b) * mask_.width + a];
    if (q == 0) {  // filled earlier, holds no point
      grid_[i] = 0;
      return true;
    }
    // The half that holds all points, 0 = both do.
    const int side_a = (q & 0xAu) == 0 ? -1 : (q & 0x5u) == 0 ? 1 : 0;
    const int side_b = (q & 0xCu) == 0 ? -1 : (q & 0x3u) == 0 ? 1 : 0;
    const std::array<std::array<int, 2>, 3> directions = {
        {{side_a, 0}, {0, side_b}, {side_a, side_b}}};
    for (std::size_t k = 0; k < 3; ++k) {
      if (k != 1 && side_a == 0) continue;
      if (k != 0 && side_b == 0) continue;
      const std::size_t other = at(a + directions[k][0], b + directions[k][1]);
      if (!grid_[other]) continue;
      grid_[i] = 0;
      relied_upon_[other] = 1;
      return true;
    }
    return false;
  }

  CellMask& mask_;
  const std::uint8_t* const quarters_;
  const bool fill_;
  const std::int32_t pitch_;
  std::vector<std::uint8_t> grid_;  ///< the mask with an empty frame around it
  std::vector<std::uint8_t> relied_upon_;
};

}  // namespace

void simplifyBorder(CellMask& mask, const std::uint8_t* quarters, bool fill) {
  BorderSimplifier(mask, quarters, fill).run();
}

}  // namespace planar_mapping::detail
