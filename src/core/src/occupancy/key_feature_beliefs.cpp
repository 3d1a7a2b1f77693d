// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/key_feature_beliefs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "occupancy/dense_features.h"
#include "grid/frame_cells.h"
#include "planar_mapping/core/base/error.h"
#include "base/point_indices.h"
#include "grid/spread_outwards.h"

namespace planar_mapping {
namespace {

using detail::FrameCells;

/// A feature agrees with the dense point at its pixel within so many depth errors.
constexpr double kAgreement = 3.0;
/// Less belief is doubt, as in Eq. 10.
constexpr double kBelieved = 0.5;

void requireFrame(const KeyFeatureBeliefs::Frame& frame, std::size_t probabilities) {
  if (!frame.indices || !frame.labels || !frame.features) {
    throw InputError("a frame needs indices, labels and features");
  }
  detail::requireIndices(frame.points, frame.indices);
  if (frame.labels->size() != frame.points.size || probabilities != frame.points.size) {
    throw InputError("labels and probability: " + std::to_string(frame.labels->size()) + " and " +
                     std::to_string(probabilities) + " values for a cloud of " +
                     std::to_string(frame.points.size) + " points");
  }
  if (!frame.T_world_sensor.matrix().allFinite()) {
    throw InputError("the pose of the sensor is not finite");
  }
}

}  // namespace

struct KeyFeatureBeliefs::Impl {
  KeyFeatureBeliefParams params;
  FeatureBeliefs beliefs;

  // Of the frame; kept for their memory.
  FrameCells cells;
  detail::DenseFeatures dense;
  std::vector<KeyFeature> features;  ///< those that can be followed
  std::vector<std::int32_t> groups;  ///< of each feature
  std::vector<double> values;        ///< belief per group, -1 = none yet

  std::int32_t groupOf(const KeyFeature& feature, const Frame& frame);
  void takeFeatures(const Frame& frame);
  std::vector<float> judgeFeatures(const Frame& frame);
  void findNeighbours();
  void spread(std::vector<std::size_t> from);
  void spreadAll();
  void spreadBelieved();

  // Adjacent groups on the same plane, up to 26 of each, kept for their memory.
  std::vector<std::array<std::int32_t, 26>> beside;
  std::vector<std::int32_t> beside_count;
};

void KeyFeatureBeliefParams::validate() const {
  beliefs.validate();
  requirePositive("resolution", resolution, "m");
  requireInRange("dense_per_cell", dense_per_cell, 1, 1000000);
  requireInRange("threads", threads, 0, 4096);
}

KeyFeatureBeliefs::KeyFeatureBeliefs(const KeyFeatureBeliefParams& params)
    : impl_(std::make_unique<Impl>()) {
  setParams(params);
}
KeyFeatureBeliefs::~KeyFeatureBeliefs() = default;
KeyFeatureBeliefs::KeyFeatureBeliefs(const KeyFeatureBeliefs& other)
    : impl_(std::make_unique<Impl>(*other.impl_)) {}
// A moved-from object is an empty one, not a trap.
KeyFeatureBeliefs::KeyFeatureBeliefs(KeyFeatureBeliefs&& other) noexcept
    : impl_(std::make_unique<Impl>()) {
  std::swap(impl_, other.impl_);
}
KeyFeatureBeliefs& KeyFeatureBeliefs::operator=(const KeyFeatureBeliefs& other) {
  if (this != &other) impl_ = std::make_unique<Impl>(*other.impl_);
  return *this;
}
KeyFeatureBeliefs& KeyFeatureBeliefs::operator=(KeyFeatureBeliefs&& other) noexcept {
  std::swap(impl_, other.impl_);
  return *this;
}

void KeyFeatureBeliefs::setParams(const KeyFeatureBeliefParams& params) {
  params.validate();
  impl_->params = params;
  impl_->beliefs.setParams(params.beliefs);
}
const KeyFeatureBeliefParams& KeyFeatureBeliefs::params() const {
  return impl_->params;
}
const FeatureBeliefs& KeyFeatureBeliefs::beliefs() const {
  return impl_->beliefs;
}
void KeyFeatureBeliefs::clear() {
  impl_->beliefs.clear();
}

/// -1 if it is in no cell.
std::int32_t KeyFeatureBeliefs::Impl::groupOf(const KeyFeature& feature, const Frame& frame) {
  const PointsView& points = frame.points;
  const float column = std::round(feature.column);
  const float row = std::round(feature.row);
  if (points.isOrganized() && column >= 0.0f && row >= 0.0f &&
      column < static_cast<float>(points.width) && row < static_cast<float>(points.height)) {
    const std::size_t pixel =
        static_cast<std::size_t>(row) * points.width + static_cast<std::size_t>(column);
    const auto place =
        std::lower_bound(frame.indices->begin(), frame.indices->end(), static_cast<int>(pixel));
    if (place != frame.indices->end() && *place == static_cast<int>(pixel) &&
        points.isFinite(pixel)) {
      const OccupancyParams& occupancy = params.beliefs.occupancy;
      const double depth = depthOf(feature.position, occupancy.optical_axis);
      const double tolerance =
          std::max(params.resolution, kAgreement * occupancy.noise.depthError(depth));
      const std::int32_t group =
          cells.groupAt(static_cast<std::size_t>(place - frame.indices->begin()));
      if (group >= 0 && (points.point(pixel) - feature.position).norm() <= tolerance) return group;
    }
  }
  const std::uint64_t cell = cells.cellOf(feature.position);
  return cell == FrameCells::kNoCell ? -1 : cells.insert(cell, -1);
}

void KeyFeatureBeliefs::Impl::takeFeatures(const Frame& frame) {
  features.clear();
  groups.clear();
  for (const KeyFeature& feature : *frame.features) {
    if (feature.track < 0 || !feature.position.allFinite()) continue;
    const std::int32_t group = groupOf(feature, frame);
    if (group < 0) continue;
    features.push_back(feature);
    groups.push_back(group);
  }
}

/// Eq. 4 of the features, and of the dense points where no feature is.
std::vector<float> KeyFeatureBeliefs::Impl::judgeFeatures(const Frame& frame) {
  const OccupancyParams& occupancy = params.beliefs.occupancy;
  std::vector<float> xyz(3 * (features.size() + dense.points().size()));
  std::vector<std::int32_t> group_of = groups;
  group_of.resize(xyz.size() / 3);
  std::size_t number = 0;
  for (const KeyFeature& feature : features) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      xyz[3 * number + axis] = static_cast<float>(feature.position[static_cast<int>(axis)]);
    }
    ++number;
  }
  if (params.dense_groups) {
    std::vector<std::uint8_t> wanted(cells.groups().size(), 0);
    for (const std::int32_t group : groups) wanted[static_cast<std::size_t>(group)] = 1;
    for (std::size_t k = 0; k < dense.points().size(); ++k) {
      const std::int32_t group = dense.groups()[k];
      if (wanted[static_cast<std::size_t>(group)] == 0) continue;
      const float* p = frame.points[static_cast<std::size_t>(dense.points()[k])];
      for (std::size_t axis = 0; axis < 3; ++axis) xyz[3 * number + axis] = p[axis];
      group_of[number++] = group;
    }
  }
  group_of.resize(number);
  std::vector<float> seen =
      featureProbabilities(PointsView(xyz.data(), number), nullptr, group_of, occupancy);
  seen.resize(features.size());
  return seen;
}

/// From the cells of all features.
void KeyFeatureBeliefs::Impl::spreadAll() {
  std::vector<std::size_t> known;
  for (std::size_t g = 0; g < values.size(); ++g) {
    if (values[g] >= 0.0) known.push_back(g);
  }
  spread(std::move(known));
}

/// The same, but first from believed features alone.
void KeyFeatureBeliefs::Impl::spreadBelieved() {
  const std::vector<double> own = values;
  std::vector<std::size_t> believed;
  std::vector<std::size_t> doubted;
  for (std::size_t g = 0; g < own.size(); ++g) {
    if (own[g] < 0.0) continue;
    (own[g] < kBelieved ? doubted : believed).push_back(g);
    if (own[g] < kBelieved) values[g] = -1.0;
  }
  spread(std::move(believed));
  for (const std::size_t g : doubted) values[g] = own[g];
  // What lies around believed cells has its value.
  spread(std::move(doubted));
}

void KeyFeatureBeliefs::Impl::findNeighbours() {
  const std::vector<FrameCells::Group>& all = cells.groups();
  beside.resize(all.size());
  beside_count.assign(all.size(), 0);
  // Each pair is looked up from one side only.
  for (std::size_t g = 0; g < all.size(); ++g) {
    for (const std::uint64_t cell : FrameCells::following(all[g].cell)) {
      const std::int32_t other = cells.find(cell, all[g].label);
      if (other < 0) continue;
      beside[g][static_cast<std::size_t>(beside_count[g]++)] = other;
      const auto o = static_cast<std::size_t>(other);
      beside[o][static_cast<std::size_t>(beside_count[o]++)] = static_cast<std::int32_t>(g);
    }
  }
}

/// From these cells, which have a value, to those around them on the same plane.
void KeyFeatureBeliefs::Impl::spread(std::vector<std::size_t> from) {
  detail::spreadOutwards(values, std::move(from), [&](std::size_t group, const auto& visit) {
    for (std::int32_t i = 0; i < beside_count[group]; ++i) {
      visit(static_cast<std::size_t>(beside[group][static_cast<std::size_t>(i)]));
    }
  });
}

KeyFeatureBeliefs::Summary KeyFeatureBeliefs::update(const Frame& frame,
                                                     std::vector<float>& probability) {
  requireFrame(frame, probability.size());
  Impl& own = *impl_;
  const OccupancyParams& occupancy = own.params.beliefs.occupancy;
  own.cells.number(frame.points, *frame.indices, *frame.labels, frame.T_world_sensor,
                   own.params.resolution, own.params.threads);
  own.dense.sample(*frame.indices, own.cells, own.params.dense_per_cell);
  const std::size_t cells_of_points = own.cells.groups().size();
  own.takeFeatures(frame);

  const std::vector<float> seen = own.judgeFeatures(frame);
  std::vector<FeatureBeliefs::Observation> observations(seen.size());
  for (std::size_t k = 0; k < seen.size(); ++k) {
    observations[k] = {own.features[k].track, own.features[k].position, seen[k]};
  }
  Summary summary;
  summary.features = own.beliefs.update(observations, frame.motion);
  summary.features_ignored = frame.features->size() - own.features.size();

  const std::size_t groups = own.cells.groups().size();
  std::vector<double> sum(groups, 0.0);
  std::vector<std::int32_t> count(groups, 0);
  for (std::size_t k = 0; k < own.features.size(); ++k) {
    const auto group = static_cast<std::size_t>(own.groups[k]);
    sum[group] += *own.beliefs.belief(own.features[k].track);
    ++count[group];
  }
  own.values.assign(groups, -1.0);
  for (std::size_t g = 0; g < groups; ++g) {
    if (count[g] > 0) own.values[g] = std::clamp(sum[g] / count[g], 0.0, 1.0);
  }
  if (!own.features.empty()) {
    own.findNeighbours();
    own.params.doubt_spreads ? own.spreadAll() : own.spreadBelieved();
  }

  own.dense.judge(frame.points, occupancy, &own.values);
  std::vector<float> belief(cells_of_points);
  for (std::size_t g = 0; g < cells_of_points; ++g) {
    double value = own.values[g];
    if (count[g] > 0) {
      ++summary.cells_of_features;
    } else if (value >= 0.0) {
      ++summary.cells_of_neighbours;
    } else {
      const detail::DenseFeatures::Support& support =
          own.dense.support(static_cast<std::int32_t>(g));
      value = std::clamp(support.sum / support.count, 0.0, 1.0);
      ++summary.cells_of_points;
    }
    belief[g] = static_cast<float>(value);
  }
  const auto lonely = static_cast<float>(occupancy.single_feature_probability);
  own.cells.giveToPoints(*frame.indices, belief, lonely, probability);
  return summary;
}

}  // namespace planar_mapping
