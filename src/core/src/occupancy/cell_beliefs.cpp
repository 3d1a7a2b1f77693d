// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "occupancy/cell_beliefs.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace planar_mapping::detail {
namespace {

constexpr std::uint64_t kNoCell = FrameCells::kNoCell;
constexpr std::size_t kMinSlots = 1024;

}  // namespace

/// The belief in the cell, added if it is new. \param oldest those seen before it may go
CellBeliefs::Belief& CellBeliefs::at(std::uint64_t cell, std::int64_t oldest) {
  if (2 * (known_ + 1) > slots_.size()) rebuild(oldest);
  const std::size_t mask = slots_.size() - 1;
  std::size_t at = hashSlot(cell, mask);
  while (slots_[at].cell != kNoCell && slots_[at].cell != cell) at = (at + 1) & mask;
  if (slots_[at].cell == kNoCell) {
    slots_[at].cell = cell;
    ++known_;
  }
  return slots_[at];
}

void CellBeliefs::rebuild(std::int64_t oldest) {
  std::vector<Belief> old = std::exchange(slots_, {});
  old.erase(std::remove_if(old.begin(), old.end(),
                           [&](const Belief& b) { return b.cell == kNoCell || b.frame < oldest; }),
            old.end());
  known_ = old.size();
  std::size_t slots = kMinSlots;
  while (slots < 4 * known_) slots *= 2;
  slots_.assign(slots, Belief());
  for (const Belief& belief : old) {
    std::size_t at = hashSlot(belief.cell, slots - 1);
    while (slots_[at].cell != kNoCell) at = (at + 1) & (slots - 1);
    slots_[at] = belief;
  }
}

FeatureBeliefs::Summary CellBeliefs::update(const std::vector<FrameCells::Group>& groups,
                                            const DenseFeatures& support,
                                            const FeatureBeliefParams& params,
                                            std::vector<float>& of_group) {
  ++frame_;
  // The observation of a cell is the mean over its samples on all its planes.
  order_.resize(groups.size());
  std::iota(order_.begin(), order_.end(), 0);
  const auto cellOf = [&](std::int32_t g) { return groups[static_cast<std::size_t>(g)].cell; };
  std::sort(order_.begin(), order_.end(), [&](std::int32_t a, std::int32_t b) {
    return cellOf(a) != cellOf(b) ? cellOf(a) < cellOf(b) : a < b;
  });
  const std::int64_t oldest = params.max_unseen_frames > 0
                                  ? frame_ - params.max_unseen_frames - 1
                                  : std::numeric_limits<std::int64_t>::min();
  FeatureBeliefs::Summary summary;
  of_group.resize(groups.size());
  for (std::size_t first = 0; first < order_.size();) {
    const std::uint64_t cell = cellOf(order_[first]);
    std::size_t end = first;
    double sum = 0.0;
    double count = 0.0;
    for (; end < order_.size() && cellOf(order_[end]) == cell; ++end) {
      sum += support.support(order_[end]).sum;
      count += support.support(order_[end]).count;
    }
    const double observed = std::clamp(sum / count, 0.0, 1.0);
    Belief& belief = at(cell, oldest);
    if (belief.frame == 0 || belief.frame < oldest) {
      belief.value = firstBelief(observed, params.update);
      ++summary.created;
    } else {
      belief.value = nextBelief(belief.value, observed, 1.0, params.update);
      ++summary.updated;
    }
    belief.frame = frame_;
    for (; first < end; ++first) {
      of_group[static_cast<std::size_t>(order_[first])] =
          static_cast<float>(std::clamp(belief.value, 0.0, 1.0));
    }
  }
  return summary;
}

}  // namespace planar_mapping::detail
