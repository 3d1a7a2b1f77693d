// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/features/cloud_features.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

constexpr int kBits = 21;  // of a cell's number along one axis
constexpr double kCells = static_cast<double>(std::int64_t{1} << (kBits - 1));

/// Numbers of a cell along the axes, packed. \return false beyond a million cells from the origin
bool packCell(const Vector3& point, double cell, std::uint64_t& packed) {
  packed = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double number = std::floor(point(axis) / cell);
    if (!(number >= -kCells && number < kCells)) return false;
    const auto bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(number + kCells));
    packed = packed << kBits | bits;
  }
  return true;
}

struct CellSum {
  Vector3 sum = Vector3::Zero();
  int points = 0;
  std::uint64_t key = 0;
};

}  // namespace

void CloudFeatureParams::validate() const {
  requirePositive("cell", cell, "m");
  requireInRange("cell", cell, 1e-6, 1e6, "m");
  requireInRange("min_points", min_points, 1, 1e9);
  requireInRange("max_features", max_features, 1, 1e6);
  requireInRange("remember_frames", remember_frames, 0, 1e6);
}

CloudFeatureSampler::CloudFeatureSampler(const CloudFeatureParams& params) : params_(params) {
  params_.validate();
}

std::vector<KeyFeature> CloudFeatureSampler::sample(const PointsView& cloud, const Indices* indices,
                                                    const std::optional<Pose>& T_world_sensor) {
  const Pose T = T_world_sensor.value_or(Pose::Identity());
  std::vector<CellSum> sums;  // in the order of their first points
  std::unordered_map<std::uint64_t, std::size_t> places;
  const std::size_t count = indices != nullptr ? indices->size() : cloud.size;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = indices != nullptr ? static_cast<std::size_t>((*indices)[k]) : k;
    if (i >= cloud.size) throw InputError("an index is outside the cloud");
    if (!cloud.isMeasured(i)) continue;
    const Vector3 point = cloud.point(i);
    std::uint64_t key = 0;
    if (!packCell(T * point, params_.cell, key)) continue;
    const auto [it, is_new] = places.emplace(key, sums.size());
    if (is_new) {
      sums.emplace_back();
      sums.back().key = key;
    }
    CellSum& sum = sums[it->second];
    sum.sum += point;
    ++sum.points;
  }

  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (sums[i].points >= params_.min_points) chosen.push_back(i);
  }
  const auto limit = static_cast<std::size_t>(params_.max_features);
  if (chosen.size() > limit) {
    std::stable_sort(chosen.begin(), chosen.end(),
                     [&](std::size_t a, std::size_t b) { return sums[a].points > sums[b].points; });
    chosen.resize(limit);
    std::sort(chosen.begin(), chosen.end());
  }

  ++frame_;
  std::vector<KeyFeature> features;
  features.reserve(chosen.size());
  for (const std::size_t i : chosen) {
    KeyFeature feature;
    feature.position = sums[i].sum / sums[i].points;
    if (T_world_sensor) {
      const auto [it, is_new] = cells_.emplace(sums[i].key, Cell());
      Cell& cell = it->second;
      if (is_new) cell.track = next_track_++;
      ++cell.sightings;
      cell.last_frame = frame_;
      feature.track = cell.track;
      feature.sightings = cell.sightings;
    } else {
      feature.track = next_track_++;
    }
    features.push_back(feature);
  }
  for (auto it = cells_.begin(); it != cells_.end();) {
    it = frame_ - it->second.last_frame > params_.remember_frames ? cells_.erase(it) : ++it;
  }
  return features;
}

void CloudFeatureSampler::reset() {
  cells_.clear();
}

}  // namespace planar_mapping
