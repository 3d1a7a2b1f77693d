// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/cell_beliefs.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "occupancy/dense_features.h"
#include "grid/frame_cells.h"
#include "planar_mapping/core/base/error.h"
#include "base/point_indices.h"

namespace planar_mapping {
namespace {

constexpr std::uint64_t kNoCell = detail::FrameCells::kNoCell;
constexpr std::size_t kFewestSlots = 1024;

struct Belief {
  std::uint64_t cell = kNoCell;
  double value = 0.0;
  std::int64_t frame = 0;  ///< when last seen; 0 = new
};

/// Beliefs by cell: open addressing, a power of two of slots.
class BeliefTable {
 public:
  std::size_t size() const { return known_; }
  /// The belief in the cell, added if it is new. \param oldest those seen before it may go
  Belief& at(std::uint64_t cell, std::int64_t oldest) {
    if (2 * (known_ + 1) > slots_.size()) rebuild(oldest);
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = detail::hashSlot(cell, mask);
    while (slots_[at].cell != kNoCell && slots_[at].cell != cell) at = (at + 1) & mask;
    if (slots_[at].cell == kNoCell) {
      slots_[at].cell = cell;
      ++known_;
    }
    return slots_[at];
  }

 private:
  void rebuild(std::int64_t oldest) {
    std::vector<Belief> old = std::exchange(slots_, {});
    old.erase(
        std::remove_if(old.begin(), old.end(),
                       [&](const Belief& b) { return b.cell == kNoCell || b.frame < oldest; }),
        old.end());
    known_ = old.size();
    std::size_t slots = kFewestSlots;
    while (slots < 4 * known_) slots *= 2;
    slots_.assign(slots, Belief());
    for (const Belief& belief : old) {
      std::size_t at = detail::hashSlot(belief.cell, slots - 1);
      while (slots_[at].cell != kNoCell) at = (at + 1) & (slots - 1);
      slots_[at] = belief;
    }
  }

  std::vector<Belief> slots_;
  std::size_t known_ = 0;
};

}  // namespace

struct CellBeliefs::Impl {
  CellBeliefParams params;
  BeliefTable beliefs;
  std::int64_t frame = 0;

  // Of the frame; kept for their memory.
  detail::FrameCells cells;
  detail::DenseFeatures features;
  std::vector<std::int32_t> order;  ///< groups by cell
  std::vector<float> group_belief;

  Summary updateBeliefs(const PointsView& points);
};

void CellBeliefParams::validate() const {
  occupancy.validate();
  update.validate();
  requirePositive("resolution", resolution, "m");
  requireInRange("features_per_cell", features_per_cell, 1, 1000000);
  requireInRange("max_unseen_frames", max_unseen_frames, 0, std::numeric_limits<int>::max());
  requireInRange("threads", threads, 0, 4096);
}

CellBeliefs::CellBeliefs(const CellBeliefParams& params) : impl_(std::make_unique<Impl>()) {
  setParams(params);
}
CellBeliefs::~CellBeliefs() = default;
CellBeliefs::CellBeliefs(const CellBeliefs& other) : impl_(std::make_unique<Impl>(*other.impl_)) {}
// A moved-from object is an empty one, not a trap.
CellBeliefs::CellBeliefs(CellBeliefs&& other) noexcept : impl_(std::make_unique<Impl>()) {
  std::swap(impl_, other.impl_);
}
CellBeliefs& CellBeliefs::operator=(const CellBeliefs& other) {
  if (this != &other) impl_ = std::make_unique<Impl>(*other.impl_);
  return *this;
}
CellBeliefs& CellBeliefs::operator=(CellBeliefs&& other) noexcept {
  std::swap(impl_, other.impl_);
  return *this;
}

void CellBeliefs::setParams(const CellBeliefParams& params) {
  params.validate();
  impl_->params = params;
}
const CellBeliefParams& CellBeliefs::params() const {
  return impl_->params;
}
std::size_t CellBeliefs::size() const {
  return impl_->beliefs.size();
}
void CellBeliefs::clear() {
  impl_->beliefs = BeliefTable();
  impl_->frame = 0;
}

CellBeliefs::Summary CellBeliefs::Impl::updateBeliefs(const PointsView& points) {
  ++frame;
  features.judge(points, params.occupancy);
  // The cell is the identity: the observation is the mean over its features on all its planes.
  const std::vector<detail::FrameCells::Group>& groups = cells.groups();
  order.resize(groups.size());
  for (std::size_t g = 0; g < order.size(); ++g) order[g] = static_cast<std::int32_t>(g);
  const auto cellOf = [&](std::int32_t g) { return groups[static_cast<std::size_t>(g)].cell; };
  std::sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
    return cellOf(a) != cellOf(b) ? cellOf(a) < cellOf(b) : a < b;
  });
  const std::int64_t oldest = params.max_unseen_frames > 0
                                  ? frame - params.max_unseen_frames - 1
                                  : std::numeric_limits<std::int64_t>::min();
  Summary summary;
  group_belief.resize(groups.size());
  for (std::size_t first = 0; first < order.size();) {
    const std::uint64_t cell = cellOf(order[first]);
    std::size_t end = first;
    double sum = 0.0;
    double count = 0.0;
    for (; end < order.size() && cellOf(order[end]) == cell; ++end) {
      const detail::DenseFeatures::Support& support = features.support(order[end]);
      sum += support.sum;
      count += support.count;
    }
    const double observed = std::clamp(sum / count, 0.0, 1.0);
    Belief& belief = beliefs.at(cell, oldest);
    if (belief.frame == 0 || belief.frame < oldest) {
      belief.value = firstBelief(observed, params.update);
      ++summary.created;
    } else {
      belief.value = nextBelief(belief.value, observed, 1.0, params.update);
      ++summary.updated;
    }
    belief.frame = frame;
    for (; first < end; ++first) {
      group_belief[static_cast<std::size_t>(order[first])] =
          static_cast<float>(std::clamp(belief.value, 0.0, 1.0));
    }
  }
  return summary;
}

CellBeliefs::Summary CellBeliefs::update(const PointsView& points, const Indices& indices,
                                         const std::vector<std::int32_t>& labels,
                                         const Pose& T_world_sensor,
                                         std::vector<float>& probability) {
  detail::requireIndices(points, &indices);
  if (labels.size() != points.size || probability.size() != points.size) {
    throw InputError("labels and probability: " + std::to_string(labels.size()) + " and " +
                     std::to_string(probability.size()) + " values for a cloud of " +
                     std::to_string(points.size) + " points");
  }
  Impl& own = *impl_;
  own.cells.number(points, indices, labels, T_world_sensor, own.params.resolution,
                   own.params.threads);
  own.features.sample(indices, own.cells, own.params.features_per_cell);
  const Summary summary = own.updateBeliefs(points);
  const auto lonely = static_cast<float>(own.params.occupancy.single_feature_probability);
  own.cells.giveToPoints(indices, own.group_belief, lonely, probability);
  return summary;
}

}  // namespace planar_mapping
