// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "occupancy/dense_features.h"

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
  constexpr double kUsual = 0.02;
  constexpr int kOctaves = 64;
  struct Octave {
    double alone[2] = {0.0, 0.0}, points[2] = {0.0, 0.0};  // off planes, on planes
    bool isSparse() const {
      const int which = points[1] > 0.0 ? 1 : 0;
      return alone[which] > kUsual * points[which];
    }
  };
  std::array<Octave, kOctaves> octaves;
  std::vector<Octave*> octave_of(support_.size());
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const int octave = std::ilogb(points.point(static_cast<std::size_t>(points_[k])).norm());
    octave_of[static_cast<std::size_t>(groups_[k])] =
        &octaves[static_cast<std::size_t>(std::clamp(octave + kOctaves / 2, 0, kOctaves - 1))];
  }
  std::uint32_t begin = 0;
  for (const FrameCells::Run& run : cells.runs()) {
    if (run.group >= 0) {
      const auto g = static_cast<std::size_t>(run.group);
      const std::size_t on_plane = cells.groups()[g].label >= 0 ? 1 : 0;
      octave_of[g]->points[on_plane] += run.end - begin;
      if (support_[g].count == 1) octave_of[g]->alone[on_plane] += 1.0;
    }
    begin = run.end;
  }
  for (std::size_t g = 0; g < support_.size(); ++g) {
    support_[g].sparse = support_[g].count == 1 && octave_of[g]->isSparse();
  }
}

}  // namespace planar_mapping::detail
