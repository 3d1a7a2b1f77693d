// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/beliefs/tracked_cells.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace planar_mapping::detail {
namespace {

/// A feature agrees with the point at its pixel within this many depth errors.
constexpr double kAgreement = 3.0;
/// Less belief is doubt, as in Eq. 10.
constexpr double kBelieved = 0.5;

/// Group of each point of the cloud, -1 = none.
std::vector<std::int32_t> groupsOfPoints(const PointsView& points, const Indices& indices,
                                         const FrameCells& cells) {
  std::vector<std::int32_t> groups(points.size, -1);
  std::size_t k = 0;
  for (const FrameCells::Run& run : cells.runs()) {
    for (; k < run.end; ++k) groups[static_cast<std::size_t>(indices[k])] = run.group;
  }
  return groups;
}

/// Group of the point at the pixel of a feature, -1 where the cloud has none, or one farther than
/// the tolerance from the feature.
std::int32_t groupAtPixel(const PointsView& points, const std::vector<std::int32_t>& groups,
                          const KeyFeature& feature, double tolerance) {
  const float column = std::round(feature.column);
  const float row = std::round(feature.row);
  if (!(column >= 0.0f) || !(row >= 0.0f) || column >= static_cast<float>(points.width) ||
      row >= static_cast<float>(points.height)) {
    return -1;
  }
  const std::size_t pixel =
      static_cast<std::size_t>(row) * points.width + static_cast<std::size_t>(column);
  if (!points.isMeasured(pixel)) return -1;
  return (points.point(pixel) - feature.position).norm() <= tolerance ? groups[pixel] : -1;
}

bool isTracked(const OccupancyFrame& frame, int point) {
  return frame.tracks != nullptr && (*frame.tracks)[static_cast<std::size_t>(point)] >= 0;
}

}  // namespace

void TrackedCells::add(std::int64_t track, const Vector3& position, std::int32_t group) {
  if (track < 0 || group < 0) return;
  if (!(position.array().abs() <= FeatureBeliefs::kFarthest).all()) return;
  features_.push_back({track, position, 0.0});
  groups_.push_back(group);
}

void TrackedCells::collect(const OccupancyFrame& frame, const Indices& indices, double resolution,
                           const OccupancyParams& occupancy, FrameCells& cells) {
  features_.clear();
  groups_.clear();
  considered_ = frame.key_features != nullptr ? frame.key_features->size() : 0;
  if (frame.tracks != nullptr) {
    std::size_t k = 0;
    for (const FrameCells::Run& run : cells.runs()) {
      for (; k < run.end; ++k) {
        if (!isTracked(frame, indices[k])) continue;
        const auto i = static_cast<std::size_t>(indices[k]);
        ++considered_;
        add((*frame.tracks)[i], frame.points.point(i), run.group);
      }
    }
  }
  if (frame.key_features == nullptr) return;
  std::vector<std::int32_t> groups;
  if (frame.points.isOrganized()) groups = groupsOfPoints(frame.points, indices, cells);
  for (const KeyFeature& feature : *frame.key_features) {
    if (feature.track < 0 || !feature.position.allFinite()) continue;
    const double depth = depthOf(feature.position, occupancy.optical_axis);
    const double tolerance = std::max(resolution, kAgreement * occupancy.noise.depthError(depth));
    std::int32_t group =
        groups.empty() ? -1 : groupAtPixel(frame.points, groups, feature, tolerance);
    const std::uint64_t cell = cells.cellOf(feature.position);
    if (group < 0 && cell != FrameCells::kNoCell) group = cells.insert(cell, -1);
    add(feature.track, feature.position, group);
  }
}

/// Eq. 4 of the features, and of the samples in their cells if there are any.
void TrackedCells::observe(const OccupancyFrame& frame, const OccupancyParams& occupancy,
                           const DenseFeatures* dense, std::size_t groups) {
  std::vector<float> xyz;
  xyz.reserve(3 * (features_.size() + (dense ? dense->points().size() : 0)));
  std::vector<std::int32_t> group_of = groups_;
  for (const FeatureBeliefs::Observation& feature : features_) {
    for (int axis = 0; axis < 3; ++axis) {
      xyz.push_back(static_cast<float>(feature.position[axis]));
    }
  }
  if (dense) {
    std::vector<std::uint8_t> wanted(groups, 0);
    for (const std::int32_t group : groups_) wanted[static_cast<std::size_t>(group)] = 1;
    for (std::size_t k = 0; k < dense->points().size(); ++k) {
      const std::int32_t group = dense->groups()[k];
      const int point = dense->points()[k];
      if (wanted[static_cast<std::size_t>(group)] == 0 || isTracked(frame, point)) continue;
      const float* p = frame.points[static_cast<std::size_t>(point)];
      xyz.insert(xyz.end(), p, p + 3);
      group_of.push_back(group);
    }
  }
  const std::vector<float> seen =
      featureProbabilities(PointsView(xyz.data(), xyz.size() / 3), nullptr, group_of, occupancy);
  for (std::size_t k = 0; k < features_.size(); ++k) features_[k].probability = seen[k];
}

void TrackedCells::findNeighbours(const FrameCells& cells) {
  const std::vector<FrameCells::Group>& all = cells.groups();
  beside_.resize(all.size());
  for (std::vector<std::size_t>& cells_beside : beside_) cells_beside.clear();
  // Each pair is looked up from one side only.
  for (std::size_t g = 0; g < all.size(); ++g) {
    for (const std::uint64_t cell : FrameCells::following(all[g].cell)) {
      const std::int32_t other = cells.find(cell, all[g].label);
      if (other < 0) continue;
      beside_[g].push_back(static_cast<std::size_t>(other));
      beside_[static_cast<std::size_t>(other)].push_back(g);
    }
  }
}

/// Gives cells without a value (-1) the mean over their neighbours on the same plane that have one,
/// ring by ring.
/// \param ring  cells with a value that have neighbours without one
void TrackedCells::spread(std::vector<std::size_t> ring) {
  std::vector<char> is_listed(values_.size(), 0);
  while (!ring.empty()) {
    std::vector<std::size_t> next;
    for (const std::size_t cell : ring) {
      for (const std::size_t other : beside_[cell]) {
        if (values_[other] >= 0.0 || is_listed[other] != 0) continue;
        is_listed[other] = 1;
        next.push_back(other);
      }
    }
    // A ring takes its values from the rings before it, so the order of cells does not matter.
    std::vector<double> means(next.size());
    for (std::size_t i = 0; i < next.size(); ++i) {
      double sum = 0.0;
      int count = 0;
      for (const std::size_t other : beside_[next[i]]) {
        if (values_[other] < 0.0) continue;
        sum += values_[other];
        ++count;
      }
      means[i] = sum / count;
    }
    for (std::size_t i = 0; i < next.size(); ++i) values_[next[i]] = means[i];
    ring.swap(next);
  }
}

/// First from believed features alone; what they reach has its value before doubt spreads.
void TrackedCells::spreadBelieved() {
  const std::vector<double> own = values_;
  std::vector<std::size_t> believed;
  std::vector<std::size_t> doubted;
  for (std::size_t g = 0; g < own.size(); ++g) {
    if (own[g] < 0.0) continue;
    (own[g] < kBelieved ? doubted : believed).push_back(g);
    if (own[g] < kBelieved) values_[g] = -1.0;
  }
  spread(std::move(believed));
  for (const std::size_t g : doubted) values_[g] = own[g];
  spread(std::move(doubted));
}

void TrackedCells::update(const OccupancyFrame& frame, const Indices& indices,
                          const std::optional<FrameMotion>& motion, const KlOccupancyParams& params,
                          const OccupancyParams& occupancy, FrameCells& cells, DenseFeatures& dense,
                          FeatureBeliefs& beliefs, KlOccupancyDiagnostics& report,
                          std::vector<float>& of_group) {
  const std::size_t groups_of_points = cells.groups().size();
  collect(frame, indices, params.resolution, occupancy, cells);
  const std::size_t groups = cells.groups().size();
  observe(frame, occupancy, params.dense_groups ? &dense : nullptr, groups);
  report.beliefs = beliefs.update(features_, motion);

  std::vector<double> sum(groups, 0.0);
  std::vector<std::int32_t> count(groups, 0);
  for (std::size_t k = 0; k < features_.size(); ++k) {
    const auto group = static_cast<std::size_t>(groups_[k]);
    sum[group] += *beliefs.belief(features_[k].track);
    ++count[group];
  }
  values_.assign(groups, -1.0);
  std::vector<std::size_t> known;
  for (std::size_t g = 0; g < groups; ++g) {
    if (count[g] == 0) continue;
    values_[g] = std::clamp(sum[g] / count[g], 0.0, 1.0);
    known.push_back(g);
  }
  if (!known.empty()) {
    findNeighbours(cells);
    params.doubt_spreads ? spread(std::move(known)) : spreadBelieved();
  }

  dense.observe(frame.points, occupancy, &values_);
  of_group.resize(groups_of_points);
  for (std::size_t g = 0; g < groups_of_points; ++g) {
    double value = values_[g];
    if (count[g] > 0) {
      ++report.cells_of_features;
    } else if (value >= 0.0) {
      ++report.cells_of_neighbours;
    } else {
      const DenseFeatures::Support& support = dense.support(static_cast<std::int32_t>(g));
      value = std::clamp(support.sum / support.count, 0.0, 1.0);
      ++report.cells_of_points;
    }
    of_group[g] = static_cast<float>(value);
  }
  report.features_ignored = considered_ - features_.size();
}

}  // namespace planar_mapping::detail
