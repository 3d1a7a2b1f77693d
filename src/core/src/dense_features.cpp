// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "dense_features.h"

namespace planar_mapping::detail {

void DenseFeatures::sample(const Indices& indices, const FrameCells& cells, int per_group) {
  points_.clear();
  groups_.clear();
  support_.assign(cells.groups().size(), Support());
  const std::vector<std::int32_t>& group_of_point = cells.groupOfPoint();
  for (std::size_t k = 0; k < indices.size(); ++k) {
    const std::int32_t group = group_of_point[k];
    if (group < 0) continue;
    std::int32_t& count = support_[static_cast<std::size_t>(group)].count;
    if (count == per_group) continue;
    ++count;
    points_.push_back(indices[k]);
    groups_.push_back(group);
  }
}

void DenseFeatures::judge(const PointsView& points, const OccupancyParams& params) {
  const std::vector<float> seen = featureProbabilities(points, &points_, groups_, params);
  for (std::size_t k = 0; k < seen.size(); ++k) {
    support_[static_cast<std::size_t>(groups_[k])].sum += seen[k];
  }
}

}  // namespace planar_mapping::detail
