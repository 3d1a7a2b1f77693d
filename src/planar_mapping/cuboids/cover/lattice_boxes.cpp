// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/cuboids/cover/lattice_boxes.h"

#include <numeric>

#include "planar_mapping/base/lists.h"

namespace planar_mapping::detail {
namespace {

/// Nothing grows along an axis of one cell: when it is its turn makes no difference, so that it may
/// as well be the last.
bool isRepeated(const AxisOrder& order, const std::array<std::int32_t, 3>& size) {
  const auto isFlat = [&](std::size_t i) { return size[order[i]] == 1; };
  return (isFlat(0) && !isFlat(1)) || (isFlat(1) && !isFlat(2)) || (isFlat(0) && !isFlat(2));
}

void grow(const BitGrid& allowed, LatticeBox& box, std::size_t axis) {
  allowed.extendUp(box, axis);
  allowed.extendDown(box, axis);
}

/// Runs beside \p run within \p sheet that end where it ends grow to the same sheet.
void markSameRuns(const BitGrid& allowed, const LatticeBox& run, const LatticeBox& sheet,
                  const AxisOrder& order, BitGrid& done) {
  LatticeBox same = run;
  for (std::int32_t i = sheet.low[order[1]]; i < sheet.high[order[1]]; ++i) {
    same.low[order[1]] = i;
    same.high[order[1]] = i + 1;
    LatticeCell before = same.low;
    LatticeCell after = same.low;
    --before[order[0]];
    after[order[0]] = same.high[order[0]];
    if (!allowed.holds(before) && !allowed.holds(after)) done.fill(same);
  }
}

bool isLargeEnough(const LatticeBox& box, const CoverRules& rules) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (box.size(k) < rules.smallest[k]) return false;
  }
  return true;
}

/// Widens the box towards \p need where an eighth of the layer beyond a face is required: then it
/// may as well hold it, as the surface in it may lie at its far side, beyond the tolerance.
LatticeBox widened(LatticeBox box, const LatticeBox& need, const BitGrid& required,
                   const BitGrid& allowed) {
  const auto isWorthHolding = [&](std::size_t axis, bool up) {
    LatticeBox layer = box;
    layer.low[axis] = up ? box.high[axis] : box.low[axis] - 1;
    layer.high[axis] = layer.low[axis] + 1;
    return 8 * required.count(layer) >= volume(layer) && allowed.all(layer);
  };
  for (std::size_t k = 0; k < 3; ++k) {
    while (box.high[k] < need.high[k] && isWorthHolding(k, true)) ++box.high[k];
    while (box.low[k] > need.low[k] && isWorthHolding(k, false)) --box.low[k];
  }
  return box;
}

}  // namespace

LatticeBox drawnBackTo(const LatticeBox& need, const BitGrid& required, const BitGrid& allowed,
                       const CoverRules& rules) {
  LatticeBox best = need;
  std::int64_t most = -1;
  forEachFit(allowed, rules, need, [&](const LatticeBox& least) {
    const LatticeBox box = widened(least, need, required, allowed);
    std::int64_t score = 8 * required.count(box);
    for (std::size_t k = 0; k < 3; ++k) score += (box.low[k] & 1) == 0;
    if (score > most) {
      most = score;
      best = box;
    }
    return true;
  });
  return best;
}

std::vector<LatticeBox> largestBoxes(const BitGrid& required, const BitGrid& allowed,
                                     const CoverRules& rules) {
  const std::vector<LatticeCell> cells = listCells(required);
  std::vector<LatticeBox> found;
  // Cells that would grow to a box that is there already.
  BitGrid done(required.size()[0], required.size()[1], required.size()[2]);
  for (const AxisOrder& order : kAxisOrders) {
    if (isRepeated(order, required.size())) continue;
    for (const LatticeCell& cell : cells) {
      if (done.at(cell[0], cell[1], cell[2])) continue;
      LatticeBox box = boxOf(cell);
      grow(allowed, box, order[0]);
      const LatticeBox run = box;
      grow(allowed, box, order[1]);
      markSameRuns(allowed, run, box, order, done);
      grow(allowed, box, order[2]);
      if (isLargeEnough(box, rules)) found.push_back(box);
    }
    for (const LatticeCell& cell : cells) done.clearWordOf(cell);
  }
  makeDistinct(found);
  return found;
}

std::size_t fewestBoxes(const BitGrid& required, const BitGrid& allowed, const CoverRules& rules,
                        std::size_t enough) {
  const std::vector<LatticeCell> cells = listCells(required);
  std::vector<LatticeBox> apart;
  const auto shareBox = [&](const LatticeBox& l, LatticeBox r) {
    include(r, l);
    return fits(allowed, rules, r);
  };
  // Neighbours mostly share a box: from one end of the window to the other and back.
  std::size_t step = cells.size() / 2 + cells.size() / 8 + 1;
  while (std::gcd(step, cells.size()) > 1) ++step;
  for (std::size_t i = 0, at = 0; i < cells.size() && apart.size() < enough; ++i) {
    const LatticeBox box = boxOf(cells[at]);
    at = (at + step) % cells.size();
    if (std::none_of(apart.rbegin(), apart.rend(),
                     [&](const LatticeBox& other) { return shareBox(box, other); })) {
      apart.push_back(box);
    }
  }
  return apart.size();
}

}  // namespace planar_mapping::detail
