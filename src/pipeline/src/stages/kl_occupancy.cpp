// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/kl_occupancy.h"

#include <cmath>
#include <unordered_map>

#include "builtin.h"

namespace planar_mapping {
namespace {

/// Beliefs of features over frames. Clouds have no detector: features are sampled from the points,
/// up to so many in each cell of a grid fixed in the world, and the cell is their identity. With
/// known poses that is what tracking would give.
class KlOccupancyStage : public Stage {
 public:
  static constexpr const char* kName = "kl_occupancy";
  static constexpr const char* kSummary =
      "judges points by features seen over frames (the paper, III-D, III-E, Eq. 4-10)";
  static constexpr StageKind kKind = StageKind::Beliefs;

  void applyProfile(Profile profile) override {
    if (profile == Profile::Paper) params_.range_floor_cells = 0.0;
  }
  void declare(ParameterTable& table) override {
    FeatureBeliefParams& beliefs = params_.beliefs;
    table.number("resolution_m", resolution_, Range::positive(),
                 "side of the cell whose features make a group and keep one identity; auto = the "
                 "automatic resolution");
    table.integer("features_per_cell", features_per_cell_, Range::between(1, 1000),
                  "[ours] features sampled in each cell");
    table.number("baseline_m", beliefs.occupancy.noise.baseline, Range::positive(), "B");
    table.number("focal_length_px", beliefs.occupancy.noise.focal_length, Range::positive(), "f");
    table.number("disparity_error_px", beliefs.occupancy.noise.disparity_error, Range::atLeast(0.0),
                 "dd");
    table.number("eta1", beliefs.occupancy.eta1, Range::above(0.0, 1.0),
                 "belief at the peak of Eq. 4");
    table.number("single_feature_probability", beliefs.occupancy.single_feature_probability,
                 Range::between(0.0, 1.0), "[ours] belief in a feature alone in its cell");
    table.number("range_floor_cells", params_.range_floor_cells, Range::atLeast(0.0),
                 "[ours] dr of Eq. 4 is at least this many cells; 0 = the paper");
    table.number("eta2", beliefs.update.eta2, Range::above(0.0, 1.0), "normalisation of Eq. 7");
    table.number("eta3", beliefs.update.eta3, Range::above(0.0, 1.0), "normalisation of Eq. 10");
    table.number("bias", beliefs.update.bias, Range::atLeast(0.0), "A of Eq. 10");
    table.integer("max_unseen_frames", beliefs.max_unseen_frames, Range::atLeast(0),
                  "[ours] features not seen for so many frames are forgotten; 0 = never");
  }
  void configure(const RunSettings&) override {
    // Poses are known: the motion is the predicted one and its factor (Eq. 9) is 1.
    params_.beliefs.motion_reading = MotionReading::RobotPose;
    if (resolution_) params_.resolution = *resolution_;
    params_.validate();
  }
  void adapt(const CloudScale& scale) override {
    if (!resolution_) resolution_ = detail::automaticResolution(scale);
    params_.resolution = *resolution_;
    if (!scale.optical) params_.beliefs.occupancy.optical_axis = Vector3::Zero();
    occupancy_.setParams(params_);
  }
  void process(Frame& frame) override;

 private:
  std::vector<std::int64_t> tracksOf(const Frame& frame) const;

  KlOccupancyParams params_;
  std::optional<double> resolution_ = 0.1;
  int features_per_cell_ = 8;
  KlOccupancy occupancy_;
};

/// The cell as one number: 21 bits an axis, which is two million cells each way.
std::int64_t cellNumber(const Vector3& p, double resolution) {
  constexpr double kHalf = 1048576.0;
  std::int64_t number = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double cell = std::floor(p[axis] / resolution) + kHalf;
    if (!(cell >= 0.0 && cell < 2.0 * kHalf)) return -1;
    number = number * 2097152 + static_cast<std::int64_t>(cell);
  }
  return number;
}

std::vector<std::int64_t> KlOccupancyStage::tracksOf(const Frame& frame) const {
  std::vector<std::int64_t> tracks(frame.cloud->size(), -1);
  std::unordered_map<std::int64_t, int> sampled;
  std::int64_t last_cell = -1;  // neighbouring points are mostly in the same cell
  int* count = nullptr;
  for (const int i : frame.indices) {
    const auto index = static_cast<std::size_t>(i);
    const Vector3 p = (*frame.cloud)[index].getVector3fMap().cast<double>();
    const std::int64_t cell = cellNumber(frame.T_world_sensor * p, params_.resolution);
    if (cell < 0) continue;
    if (cell != last_cell) count = &sampled[cell];
    last_cell = cell;
    if ((*count)++ < features_per_cell_) tracks[index] = cell;
  }
  return tracks;
}

void KlOccupancyStage::process(Frame& frame) {
  std::vector<std::int32_t> labels(frame.cloud->size(), -1);
  for (std::size_t plane = 0; plane < frame.planes.size(); ++plane) {
    for (const int i : frame.planes[plane].inliers) {
      labels[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(plane);
    }
  }
  const std::vector<std::int64_t> tracks = tracksOf(frame);
  OccupancyFrame input;
  input.points = viewOf(*frame.cloud);
  input.indices = &frame.indices;
  input.tracks = &tracks;
  input.plane_labels = &labels;
  KlOccupancyDiagnostics diagnostics;
  const std::vector<float> beliefs = occupancy_.process(input, &diagnostics);
  frame.probability.assign(frame.cloud->size(), 0.0f);
  for (std::size_t i = 0; i < beliefs.size(); ++i) {
    frame.probability[static_cast<std::size_t>(frame.indices[i])] = beliefs[i];
  }
  frame.features = diagnostics.beliefs.created + diagnostics.beliefs.updated;
  frame.matches = diagnostics.beliefs.updated;
}

}  // namespace

namespace detail {

void addKlOccupancy(StageTable& table) {
  table.add<KlOccupancyStage>();
}

}  // namespace detail
}  // namespace planar_mapping
