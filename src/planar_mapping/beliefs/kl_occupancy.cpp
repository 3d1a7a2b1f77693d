// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/beliefs/kl_occupancy.h"

#include <algorithm>
#include <numeric>
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

}  // namespace

struct KlOccupancy::Impl {
  KlOccupancyParams params;
  OccupancyParams occupancy;          ///< with the floor of the range error and the axis
  std::optional<Vector3> found_axis;  ///< of the first cloud
  FeatureBeliefs tracks;
  FeatureBeliefs cell_beliefs;  ///< the track of a sample is its cell
  bool has_before = false;      ///< a frame taken by tracks, ...
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
    cell_beliefs.setParams(used);
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

  /// Eq. 10 for cells: the observation of a cell is the mean over its samples on all its planes.
  FeatureBeliefs::Summary updateCells() {
    const std::vector<detail::FrameCells::Group>& groups = cells.groups();
    std::vector<std::size_t> order(groups.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return groups[a].cell != groups[b].cell ? groups[a].cell < groups[b].cell : a < b;
    });
    std::vector<FeatureBeliefs::Observation> seen;
    for (std::size_t first = 0, end = 0; first < order.size(); first = end) {
      const std::uint64_t cell = groups[order[first]].cell;
      double sum = 0.0;
      double count = 0.0;
      bool is_sparse = true;  // points alone, where that is no doubt
      for (; end < order.size() && groups[order[end]].cell == cell; ++end) {
        const auto& support = samples.support(static_cast<std::int32_t>(order[end]));
        sum += support.sum;
        count += support.count;
        is_sparse = is_sparse && support.sparse;
      }
      seen.push_back({static_cast<std::int64_t>(cell), Vector3::Zero(),
                      std::clamp(sum / count, 0.0, 1.0), is_sparse});
    }
    const FeatureBeliefs::Summary summary = cell_beliefs.update(seen);
    of_group.resize(groups.size());
    auto of_cell = seen.begin();
    double belief = 0.0;
    std::uint64_t before = detail::FrameCells::kNoCell;
    for (const std::size_t group : order) {
      if (groups[group].cell != before) {
        belief = *cell_beliefs.belief((of_cell++)->track);
        before = groups[group].cell;
      }
      of_group[group] = static_cast<float>(std::clamp(belief, 0.0, 1.0));
    }
    return summary;
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
  impl_->cell_beliefs.clear();
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
    report.beliefs = own.updateCells();
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
