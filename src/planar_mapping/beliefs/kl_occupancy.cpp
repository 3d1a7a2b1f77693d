// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/beliefs/kl_occupancy.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/point_indices.h"
#include "planar_mapping/beliefs/dense_features.h"
#include "planar_mapping/beliefs/tracked_cells.h"
#include "planar_mapping/geometry/cloud_scale.h"

namespace planar_mapping {
namespace {

template <typename T>
void requireOnePerPoint(const char* name, const std::vector<T>* values, std::size_t points) {
  if (!values || values->size() == points) return;
  throw InputError(std::string(name) + ": " + std::to_string(values->size()) +
                   " values for a cloud of " + std::to_string(points) + " points");
}

void requireFrame(const OccupancyFrame& frame) {
  detail::requireIndices(frame.points, frame.indices);
  requireOnePerPoint("plane labels", frame.plane_labels, frame.points.size);
  requireOnePerPoint("tracks", frame.tracks, frame.points.size);
  if (frame.T_world_sensor) requireRigid("the pose of the sensor", *frame.T_world_sensor);
  if (frame.motion) frame.motion->validate();
}

bool hasTracks(const OccupancyFrame& frame) {
  return (frame.tracks && !frame.tracks->empty()) ||
         (frame.key_features && !frame.key_features->empty());
}

/// Beliefs of the cells of a grid fixed in the world (Eq. 10): what FeatureBeliefs says of samples
/// whose track is their cell, at the price of one look-up a cell instead of several a point.
class CellBeliefs {
 public:
  /// One frame.
  /// \param support   Eq. 4 of the samples of each group
  /// \param of_group  becomes the belief in the cell of each group
  FeatureBeliefs::Summary update(const std::vector<detail::FrameCells::Group>& groups,
                                 const detail::DenseFeatures& support,
                                 const FeatureBeliefParams& params, std::vector<float>& of_group) {
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
        const detail::DenseFeatures::Support& seen = support.support(order_[end]);
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

 private:
  struct Belief {
    double value = 0.0;
    std::int64_t frame = 0;  ///< when last seen
  };

  std::unordered_map<std::uint64_t, Belief> known_;  ///< by cell
  std::int64_t frame_ = 0;
  std::vector<std::int32_t> order_;  ///< groups by cell; kept for its memory
};

}  // namespace

struct KlOccupancy::Impl {
  KlOccupancyParams params;
  OccupancyParams occupancy;          ///< with the floor of the range error and the axis
  std::optional<Vector3> found_axis;  ///< of the first cloud
  FeatureBeliefs tracks;
  CellBeliefs cell_beliefs;
  bool has_before = false;  ///< a frame taken by tracks, ...
  std::optional<Pose> T_world_before;
  bool before_is_last = false;  ///< ... which is the one before

  void useParams() {
    occupancy = params.beliefs.occupancy;
    occupancy.min_range_error =
        std::max(occupancy.min_range_error, params.range_floor_cells * params.resolution);
    occupancy.optical_axis = params.optical_axis.value_or(found_axis.value_or(Vector3::UnitZ()));
    FeatureBeliefParams used = params.beliefs;
    used.occupancy = occupancy;
    tracks.setParams(used);
  }

  // Of the frame; kept for their memory.
  detail::FrameCells cells;
  detail::DenseFeatures samples;
  detail::TrackedCells tracked_cells;
  Indices all;
  std::vector<std::int32_t> no_labels;
  std::vector<float> of_group;

  /// Since the last frame taken by tracks.
  std::optional<FrameMotion> motionOf(const OccupancyFrame& frame) const {
    if (!has_before) return std::nullopt;
    if (frame.motion && before_is_last) return frame.motion;
    if (!frame.T_world_sensor || !T_world_before) return std::nullopt;
    FrameMotion motion;
    motion.T_now_before = frame.T_world_sensor->inverse() * *T_world_before;
    if (frame.motion) motion.covariance = frame.motion->covariance;
    return motion;
  }

  /// \return how many points are no measurement
  std::size_t clearNotMeasured(const OccupancyFrame& frame, const Indices& indices,
                               std::vector<float>& probability) const {
    std::size_t cleared = 0;
    std::size_t begin = 0;
    for (const detail::FrameCells::Run& run : cells.runs()) {
      for (std::size_t k = run.group < 0 ? begin : run.end; k < run.end; ++k) {
        const auto i = static_cast<std::size_t>(indices[k]);
        if (frame.points.isMeasured(i)) continue;
        probability[i] = 0.0f;
        ++cleared;
      }
      begin = run.end;
    }
    return cleared;
  }
};

void KlOccupancyParams::validate() const {
  beliefs.validate();
  OccupancyParams along = beliefs.occupancy;
  along.optical_axis = optical_axis.value_or(along.optical_axis);
  along.validate();
  requirePositive("resolution", resolution, "m");
  requireInRange("range_floor_cells", range_floor_cells, 0.0, 1e6);
  requireInRange("features_per_cell", features_per_cell, 1, 1000000);
  requireInRange("min_probability", min_probability, 0.0, 1.0);
  requireInRange("source", static_cast<int>(source), 0, static_cast<int>(FeatureSource::Cells));
  requireInRange("threads", threads, 0, 4096);
}

KlOccupancy::KlOccupancy(const KlOccupancyParams& params) : impl_(std::make_unique<Impl>()) {
  setParams(params);
}
KlOccupancy::~KlOccupancy() = default;
KlOccupancy::KlOccupancy(const KlOccupancy& other) : impl_(std::make_unique<Impl>(*other.impl_)) {}
KlOccupancy::KlOccupancy(KlOccupancy&& other) noexcept : impl_(std::make_unique<Impl>()) {
  std::swap(impl_, other.impl_);
}
KlOccupancy& KlOccupancy::operator=(const KlOccupancy& other) {
  if (this != &other) impl_ = std::make_unique<Impl>(*other.impl_);
  return *this;
}
KlOccupancy& KlOccupancy::operator=(KlOccupancy&& other) noexcept {
  impl_ = std::exchange(other.impl_, std::make_unique<Impl>());
  return *this;
}

void KlOccupancy::setParams(const KlOccupancyParams& params) {
  params.validate();
  impl_->params = params;
  impl_->useParams();
}
const KlOccupancyParams& KlOccupancy::params() const {
  return impl_->params;
}
const FeatureBeliefs& KlOccupancy::tracks() const {
  return impl_->tracks;
}
void KlOccupancy::reset() {
  impl_->tracks.clear();
  impl_->cell_beliefs = CellBeliefs();
  impl_->has_before = impl_->before_is_last = false;
  impl_->found_axis.reset();
}

KlOccupancyDiagnostics KlOccupancy::update(const OccupancyFrame& frame,
                                           std::vector<float>& probability) {
  requireFrame(frame);
  Impl& own = *impl_;
  if (!frame.indices) own.all = usablePoints(frame.points);
  const Indices& indices = frame.indices ? *frame.indices : own.all;
  if (!own.params.optical_axis && !own.found_axis && !indices.empty()) {
    own.found_axis = Vector3(0.0, 0.0, isCameraView(frame.points, nullptr) ? 1.0 : 0.0);
    own.useParams();
  }
  if (!frame.plane_labels) own.no_labels.assign(frame.points.size, -1);
  const Pose T_world_sensor = frame.T_world_sensor.value_or(Pose::Identity());
  own.cells.number(frame.points, indices, frame.plane_labels ? *frame.plane_labels : own.no_labels,
                   T_world_sensor, own.params.resolution, own.params.threads);
  own.samples.sample(indices, own.cells, own.params.features_per_cell);

  KlOccupancyDiagnostics report;
  report.points_considered = frame.indices ? indices.size() : frame.points.size;
  const bool by_tracks = own.params.source == FeatureSource::Tracks ||
                         (own.params.source == FeatureSource::Auto && hasTracks(frame));
  if (by_tracks) {
    report.source = FeatureSource::Tracks;
    own.tracked_cells.update(frame, indices, own.motionOf(frame), own.params, own.occupancy,
                             own.cells, own.samples, own.tracks, report, own.of_group);
    own.has_before = true;
    own.T_world_before = frame.T_world_sensor;
  } else {
    own.samples.observe(frame.points, own.occupancy);
    own.samples.findSparse(frame.points, own.cells);
    report.beliefs =
        own.cell_beliefs.update(own.cells.groups(), own.samples, own.params.beliefs, own.of_group);
  }
  own.before_is_last = by_tracks;

  probability.assign(frame.points.size, 0.0f);
  const auto single = static_cast<float>(own.occupancy.single_feature_probability);
  own.cells.giveToPoints(indices, own.of_group, single, probability);
  if (by_tracks && frame.tracks) {
    for (const int i : indices) {
      const auto belief = own.tracks.belief((*frame.tracks)[static_cast<std::size_t>(i)]);
      if (belief) probability[static_cast<std::size_t>(i)] = static_cast<float>(*belief);
    }
  }
  report.points_not_measured =
      report.points_considered - indices.size() + own.clearNotMeasured(frame, indices, probability);
  // What usual frames need again and again is kept; that of a huge cloud would be in the way.
  constexpr std::size_t kMaxPointsKept = std::size_t{1} << 21;
  if (frame.points.size > kMaxPointsKept) {
    own.cells = detail::FrameCells();
    own.samples = detail::DenseFeatures();
    own.all = Indices();
    own.no_labels = std::vector<std::int32_t>();
    own.of_group = std::vector<float>();
  }
  return report;
}

}  // namespace planar_mapping
