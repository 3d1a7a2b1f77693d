// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/kl_occupancy.h"

#include <algorithm>

#include "../cell_beliefs.h"
#include "builtin.h"
#include "noise_keys.h"

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
    noise_.declare(table);
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
    noise_.adapt(scale);
    params_.beliefs.occupancy.noise = noise_.noise();
    params_.validate();
    if (!scale.optical) params_.beliefs.occupancy.optical_axis = Vector3::Zero();
    detail::CellBeliefParams beliefs;
    beliefs.occupancy = params_.beliefs.occupancy;
    beliefs.occupancy.min_range_error =
        std::max(beliefs.occupancy.min_range_error, params_.range_floor_cells * params_.resolution);
    beliefs.update = params_.beliefs.update;
    beliefs.resolution = params_.resolution;
    beliefs.features_per_cell = features_per_cell_;
    beliefs.max_unseen_frames = params_.beliefs.max_unseen_frames;
    beliefs_.setParams(beliefs);
  }
  void process(Frame& frame) override;

 private:
  KlOccupancyParams params_;
  std::optional<double> resolution_ = 0.1;
  int features_per_cell_ = 8;
  detail::NoiseKeys noise_;
  detail::CellBeliefs beliefs_;
  std::vector<std::int32_t> labels_;  ///< of the frame; kept for its memory
};

void KlOccupancyStage::process(Frame& frame) {
  labels_.assign(frame.cloud->size(), -1);
  for (std::size_t plane = 0; plane < frame.planes.size(); ++plane) {
    for (const int i : frame.planes[plane].inliers) {
      labels_[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(plane);
    }
  }
  frame.probability.assign(frame.cloud->size(), 0.0f);
  const detail::CellBeliefs::Summary seen = beliefs_.update(
      viewOf(*frame.cloud), frame.indices, labels_, frame.T_world_sensor, frame.probability);
  frame.features = seen.created + seen.updated;
  frame.matches = seen.updated;
}

}  // namespace

namespace detail {

void addKlOccupancy(StageTable& table) {
  table.add<KlOccupancyStage>();
}

}  // namespace detail
}  // namespace planar_mapping
