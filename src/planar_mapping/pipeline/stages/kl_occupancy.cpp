// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/filters/kl_occupancy_filter.h"

#include "planar_mapping/pipeline/noise_keys.h"
#include "planar_mapping/pipeline/stages/builtin.h"

namespace planar_mapping {
namespace {

class KlOccupancyStage : public Stage {
 public:
  static constexpr const char* kName = "kl_occupancy";
  static constexpr const char* kSummary =
      "probability of points from features seen over frames (the paper, III-D, III-E, Eq. 4-10)";
  static constexpr StageKind kKind = StageKind::Beliefs;

  void applyProfile(Profile profile) override {
    if (profile != Profile::Paper) return;
    params_.range_floor_cells = 0.0;
    params_.dense_groups = false;
    params_.doubt_spreads = true;
  }
  void declare(ParameterTable& table) override {
    table.number("resolution_m", resolution_, Range::positive(),
                 "side of the cell whose features make a group and keep one identity; auto = the "
                 "automatic resolution");
    table.word("features", params_.source,
               {{"auto", FeatureSource::Auto},
                {"tracks", FeatureSource::Tracks},
                {"cells", FeatureSource::Cells}},
               "tracks = key features of the images, cells = sampled from the cloud, with the cell "
               "as identity; auto = tracks in frames that have key features, else cells");
    table.word("motion_reading", params_.beliefs.motion_reading,
               {{"feature", MotionReading::FeaturePosition}, {"pose", MotionReading::RobotPose}},
               "x of Eq. 9, for tracks: the position of the feature or the pose of the robot");
    table.word("update", params_.beliefs.update.rule,
               {{"kl", UpdateRule::KullbackLeibler},
                {"log_odds", UpdateRule::LogOdds},
                {"none", UpdateRule::None}},
               "kl = Eq. 5-10; [ours] log_odds = the classical update, none = the newest sighting "
               "alone, both as comparison");
    table.integer("features_per_cell", params_.features_per_cell, Range::between(1, 1000),
                  "[ours] features sampled in each cell");
    table.flag("dense_groups", params_.dense_groups,
               "[ours] Eq. 4 is over tracked features and points of their cell; false = over "
               "features, the paper");
    table.flag("doubt_spreads", params_.doubt_spreads,
               "[ours] doubt in a track spreads to adjacent cells although believed ones are "
               "within reach");
    noise_.declare(table);
    table.number("eta1", params_.beliefs.occupancy.eta1, Range::above(0.0, 1.0),
                 "belief at the peak of Eq. 4");
    table.number("single_feature_probability", params_.beliefs.occupancy.single_feature_probability,
                 Range::between(0.0, 1.0), "[ours] belief in a feature alone in its cell");
    table.number("range_floor_cells", params_.range_floor_cells, Range::atLeast(0.0),
                 "[ours] dr of Eq. 4 is at least this many cells; 0 = the paper");
    table.number("eta2", params_.beliefs.update.eta2, Range::above(0.0, 1.0),
                 "normalisation of Eq. 7");
    table.number("eta3", params_.beliefs.update.eta3, Range::above(0.0, 1.0),
                 "normalisation of Eq. 10");
    table.number("bias", params_.beliefs.update.bias, Range::atLeast(0.0), "A of Eq. 10");
    LogOddsParams& odds = params_.beliefs.update.log_odds;
    table.number("log_odds_hit", odds.hit, Range::between(0.0, 1.0),
                 "probability a hit stands for, between 0.5 and 1");
    table.number("log_odds_miss", odds.miss, Range::between(0.0, 1.0),
                 "probability a miss stands for, between 0 and 0.5");
    table.number("log_odds_min", odds.min_probability, Range::between(0.0, 1.0),
                 "log-odds are kept above those of this probability, between 0 and 0.5");
    table.number("log_odds_max", odds.max_probability, Range::between(0.0, 1.0),
                 "log-odds are kept below those of this probability, between 0.5 and 1");
    table.integer("max_unseen_frames", params_.beliefs.max_unseen_frames, Range::atLeast(0),
                  "[ours] features not seen for this many frames are forgotten; 0 = never");
    table.basic({"resolution_m", "features", "update"});
  }
  void configure(const RunSettings& settings) override {
    params_.threads = settings.threads;
    if (!resolution_) return;
    params_.resolution = *resolution_;
    params_.validate();
  }
  void adapt(const CloudScale& scale) override {
    if (!resolution_) resolution_ = automaticResolution(scale);
    params_.resolution = *resolution_;
    noise_.adapt(scale);
    params_.beliefs.occupancy.noise = noise_.noise();
    params_.optical_axis = Vector3(0.0, 0.0, scale.optical ? 1.0 : 0.0);
    filter_.setParams(params_);
  }

  bool usesKeyFeatures(const Frame&) const override {
    return params_.source == FeatureSource::Tracks;
  }
  void process(Frame& frame) override {
    std::vector<std::int32_t> labels(frame.cloud->size(), -1);
    for (std::size_t plane = 0; plane < frame.planes.size(); ++plane) {
      for (const int i : frame.planes[plane].inliers)
        labels[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(plane);
    }
    filter_.setInputCloud(frame.cloud);
    filter_.setIndices(detail::sharedIndices(frame.indices));
    filter_.setSensorPose(frame.T_world_sensor);
    filter_.setInputPlaneLabels(std::move(labels));
    filter_.setInputKeyFeatures(frame.key_features);
    filter_.setMotion(frame.motion);
    Indices believed;  // the map weighs the others by their probability
    filter_.filter(believed);
    frame.probability = filter_.takeProbabilities();
    filter_.setInputPlaneLabels({});
    filter_.setInputCloud(nullptr);
    const FeatureBeliefs::Summary& seen = filter_.getDiagnostics().beliefs;
    frame.features = seen.created + seen.updated;
    frame.matches = seen.updated;
  }

 private:
  KlOccupancyParams params_;
  std::optional<double> resolution_ = params_.resolution;
  detail::NoiseKeys noise_;
  KLOccupancyFilter<pcl::PointXYZ> filter_;
};
}  // namespace

void detail::addKlOccupancy(StageTable& table) {
  table.add<KlOccupancyStage>();
}

}  // namespace planar_mapping
