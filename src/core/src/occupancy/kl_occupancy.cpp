// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/kl_occupancy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "planar_mapping/core/occupancy/detail/cell_probability.h"
#include "planar_mapping/core/base/error.h"
#include "base/point_indices.h"

namespace planar_mapping {
namespace {

/// Points of the cloud with what belongs to them, one entry each.
struct Selection {
  Indices indices;                   ///< into the cloud
  std::vector<std::size_t> place;    ///< position among the points that count
  std::vector<std::int32_t> groups;  ///< of Eq. 4
};

template <typename T>
void requireOnePerPoint(const char* name, const std::vector<T>* values, std::size_t points) {
  if (!values || values->size() == points) return;
  throw InputError(std::string(name) + ": " + std::to_string(values->size()) +
                   " values for a cloud of " + std::to_string(points) + " points");
}

bool isUsable(const float* p) {
  constexpr double kFarthest = FeatureBeliefs::kFarthest;
  return std::abs(p[0]) <= kFarthest && std::abs(p[1]) <= kFarthest && std::abs(p[2]) <= kFarthest;
}

/// With groups instead of a grid nothing is adjacent: points take the mean of their own group.
void spreadWithinGroups(const Selection& tracked, const Selection& untracked,
                        std::vector<float>& result) {
  std::vector<std::pair<std::int32_t, double>> of_group;
  for (std::size_t k = 0; k < tracked.indices.size(); ++k) {
    if (tracked.groups[k] >= 0) of_group.emplace_back(tracked.groups[k], result[tracked.place[k]]);
  }
  std::sort(of_group.begin(), of_group.end());
  for (std::size_t k = 0; k < untracked.indices.size(); ++k) {
    const std::int32_t group = untracked.groups[k];
    auto member = std::lower_bound(of_group.begin(), of_group.end(), std::make_pair(group, -1.0));
    double sum = 0.0;
    int count = 0;
    for (; member != of_group.end() && member->first == group; ++member, ++count) {
      sum += member->second;
    }
    if (count > 0) result[untracked.place[k]] = static_cast<float>(sum / count);
  }
}

}  // namespace

void KlOccupancyParams::validate() const {
  beliefs.validate();
  requirePositive("resolution", resolution, "m");
  requireInRange("range_floor_cells", range_floor_cells, 0.0, 1e6);
  requireInRange("min_probability", min_probability, 0.0, 1.0);
}

KlOccupancy::KlOccupancy(const KlOccupancyParams& params) {
  setParams(params);
}

void KlOccupancy::setParams(const KlOccupancyParams& params) {
  params.validate();
  params_ = params;
  beliefs_.setParams(params.beliefs);
}

std::vector<float> KlOccupancy::process(const OccupancyFrame& frame,
                                        KlOccupancyDiagnostics* diagnostics) {
  const PointsView& points = frame.points;
  detail::requireIndices(points, frame.indices);
  if (!frame.sensor.allFinite()) throw InputError("sensor: its position is not finite");
  requireOnePerPoint("tracks", frame.tracks, points.size);
  requireOnePerPoint("plane labels", frame.plane_labels, points.size);
  requireOnePerPoint("groups", frame.groups, points.size);

  OccupancyParams occupancy = params_.beliefs.occupancy;
  occupancy.min_range_error =
      std::max(occupancy.min_range_error, params_.range_floor_cells * params_.resolution);
  const std::size_t n = detail::countOf(points, frame.indices);
  const std::vector<std::int32_t> cells =
      frame.groups ? std::vector<std::int32_t>()
                   : gridGroups(points, frame.indices, frame.plane_labels, params_.resolution);

  KlOccupancyDiagnostics report;
  report.points_considered = n;
  Selection tracked;
  Selection untracked;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = detail::at(frame.indices, k);
    if (!isUsable(points[i])) {
      ++report.points_not_finite;
      continue;
    }
    Selection& part = frame.tracks && (*frame.tracks)[i] >= 0 ? tracked : untracked;
    part.indices.push_back(static_cast<int>(i));
    part.place.push_back(k);
    part.groups.push_back(frame.groups ? (*frame.groups)[i] : cells[k]);
  }
  report.tracked = tracked.indices.size();

  // Groups of Eq. 4 hold features among themselves; dense points judge where no feature does.
  const std::vector<float> of_features =
      featureProbabilities(points, &tracked.indices, tracked.groups, occupancy, frame.sensor);
  const std::vector<float> dense =
      featureProbabilities(points, &untracked.indices, untracked.groups, occupancy, frame.sensor);

  std::vector<FeatureBeliefs::Observation> seen(tracked.indices.size());
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const auto i = static_cast<std::size_t>(tracked.indices[k]);
    seen[k] = {(*frame.tracks)[i], points.point(i) - frame.sensor, of_features[k]};
  }
  report.beliefs = beliefs_.update(seen, frame.motion);

  std::vector<float> result(n, -1.0f);
  for (std::size_t k = 0; k < seen.size(); ++k) {
    result[tracked.place[k]] = static_cast<float>(*beliefs_.belief(seen[k].track));
  }
  if (!seen.empty() && !untracked.indices.empty()) {
    if (frame.groups) {
      spreadWithinGroups(tracked, untracked, result);
    } else {
      result =
          spreadToPoints(points, frame.indices, frame.plane_labels, params_.resolution, result);
    }
  }
  for (std::size_t k = 0; k < untracked.indices.size(); ++k) {
    float& probability = result[untracked.place[k]];
    if (probability < 0.0f) {
      probability = dense[k];
      ++report.from_dense_support;
    } else {
      ++report.from_features;
    }
  }
  for (float& probability : result) probability = std::clamp(probability, 0.0f, 1.0f);
  if (diagnostics) *diagnostics = report;
  return result;
}

}  // namespace planar_mapping
