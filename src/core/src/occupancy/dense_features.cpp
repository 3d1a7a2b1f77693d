// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "occupancy/dense_features.h"

#include <algorithm>

namespace planar_mapping::detail {

void DenseFeatures::sample(const Indices& indices, const FrameCells& cells, int per_group) {
  support_.assign(cells.groups().size(), Support());
  points_.clear();
  groups_.clear();
  std::size_t begin = 0;
  for (const FrameCells::Run& run : cells.runs()) {
    if (run.group >= 0) {
      std::int32_t& count = support_[static_cast<std::size_t>(run.group)].count;
      const std::size_t taken =
          std::min(run.end - begin, static_cast<std::size_t>(per_group - count));
      count += static_cast<std::int32_t>(taken);
      points_.insert(points_.end(), &indices[begin], &indices[begin] + taken);
      groups_.insert(groups_.end(), taken, run.group);
    }
    begin = run.end;
  }
}

void DenseFeatures::observe(const PointsView& points, const OccupancyParams& params,
                            const std::vector<double>* known) {
  if (known != nullptr) {
    std::size_t left = 0;
    for (std::size_t k = 0; k < points_.size(); ++k) {
      if ((*known)[static_cast<std::size_t>(groups_[k])] >= 0.0) continue;
      points_[left] = points_[k];
      groups_[left++] = groups_[k];
    }
    points_.resize(left);
    groups_.resize(left);
  }
  const std::vector<float> seen = featureProbabilities(points, &points_, groups_, params);
  for (std::size_t k = 0; k < seen.size(); ++k) {
    support_[static_cast<std::size_t>(groups_[k])].sum += seen[k];
  }
}

}  // namespace planar_mapping::detail
