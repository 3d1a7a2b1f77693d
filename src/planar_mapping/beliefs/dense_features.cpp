// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/beliefs/dense_features.h"

#include <algorithm>
#include <array>
#include <cmath>

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

void DenseFeatures::findSparse(const PointsView& points, const FrameCells& cells) {
  // Of the points on planes at a range, to a factor of two, that are alone in their cell: at most
  // 1 % in images, also where stereo is noisy, 2 % and more of a laser scanner.
  constexpr double kMaxUsuallyAlone = 0.02;
  constexpr std::size_t kEnough = 50;  // points; fewer tell nothing of a range
  constexpr int kOctaves = 64;
  std::vector<std::size_t> octave_of(support_.size(), 0);
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const int octave = std::ilogb(points.point(static_cast<std::size_t>(points_[k])).norm());
    octave_of[static_cast<std::size_t>(groups_[k])] =
        static_cast<std::size_t>(std::clamp(octave + kOctaves / 2, 0, kOctaves - 1));
  }
  std::vector<std::size_t> points_in(support_.size(), 0);
  std::size_t begin = 0;
  for (const FrameCells::Run& run : cells.runs()) {
    if (run.group >= 0) points_in[static_cast<std::size_t>(run.group)] += run.end - begin;
    begin = run.end;
  }
  // Where nothing is on a plane, all points tell.
  const auto isOnPlane = [&](std::size_t g) { return cells.groups()[g].label >= 0; };
  bool has_planes = false;
  for (std::size_t g = 0; g < support_.size(); ++g) has_planes = has_planes || isOnPlane(g);
  std::array<std::size_t, kOctaves> all{}, alone{};
  for (std::size_t g = 0; g < support_.size(); ++g) {
    if (has_planes && !isOnPlane(g)) continue;
    all[octave_of[g]] += points_in[g];
    alone[octave_of[g]] += points_in[g] == 1 ? 1 : 0;
  }
  // A range that tells nothing is as the next nearer one that does, else as the first that does.
  std::array<bool, kOctaves> is_sparse{};
  std::size_t known = 0;
  while (known + 1 < kOctaves && all[known] < kEnough) ++known;
  for (std::size_t i = 0; i < kOctaves; ++i) {
    if (i > known && all[i] >= kEnough) known = i;
    is_sparse[i] = all[known] >= kEnough && static_cast<double>(alone[known]) >
                                                kMaxUsuallyAlone * static_cast<double>(all[known]);
  }
  for (std::size_t g = 0; g < support_.size(); ++g)
    support_[g].sparse = points_in[g] == 1 && is_sparse[octave_of[g]];
}

}  // namespace planar_mapping::detail
