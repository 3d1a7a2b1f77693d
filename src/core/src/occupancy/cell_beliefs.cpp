// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "occupancy/cell_beliefs.h"

#include <algorithm>
#include <iterator>
#include <numeric>

namespace planar_mapping::detail {

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
  FeatureBeliefs::Summary summary;
  of_group.resize(groups.size());
  for (std::size_t first = 0; first < order_.size();) {
    const std::uint64_t cell = cellOf(order_[first]);
    std::size_t end = first;
    double sum = 0.0;
    double count = 0.0;
    bool is_sparse = true;  // points alone, where that is no doubt
    for (; end < order_.size() && cellOf(order_[end]) == cell; ++end) {
      const DenseFeatures::Support& seen = support.support(order_[end]);
      sum += seen.sum;
      count += seen.count;
      is_sparse = is_sparse && seen.sparse;
    }
    const double observed = std::clamp(sum / count, 0.0, 1.0);
    const auto [place, is_new] = known_.try_emplace(cell);
    Belief& belief = place->second;
    if (is_new) {
      belief.value = firstBelief(observed, params.update);
      ++summary.created;
    } else {
      if (!is_sparse) belief.value = nextBelief(belief.value, observed, 1.0, params.update);
      ++summary.updated;
    }
    belief.frame = frame_;
    for (; first < end; ++first) {
      of_group[static_cast<std::size_t>(order_[first])] =
          static_cast<float>(std::clamp(belief.value, 0.0, 1.0));
    }
  }
  for (auto cell = known_.begin(); params.max_unseen_frames > 0 && cell != known_.end();) {
    const bool is_old = frame_ - cell->second.frame > params.max_unseen_frames;
    cell = is_old ? known_.erase(cell) : std::next(cell);
    summary.forgotten += is_old ? 1 : 0;
  }
  summary.unseen = known_.size() - summary.created - summary.updated;
  return summary;
}

}  // namespace planar_mapping::detail
