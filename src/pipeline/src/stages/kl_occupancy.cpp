// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "builtin.h"
#include "noise_keys.h"
#include "planar_mapping/core/occupancy/cell_beliefs.h"
#include "planar_mapping/core/occupancy/key_feature_beliefs.h"

namespace planar_mapping {
namespace {

enum class FeatureSource : std::uint8_t { Auto, Tracks, Cells };

/// Beliefs of features over frames. Where key features were followed over the images, their tracks
/// are the identities. A cloud alone has no detector: features are sampled from its points, up to
/// so many in each cell of a grid fixed in the world, and the cell is their identity.
class KlOccupancyStage : public Stage {
 public:
  static constexpr const char* kName = "kl_occupancy";
  static constexpr const char* kSummary =
      "judges points by features seen over frames (the paper, III-D, III-E, Eq. 4-10)";
  static constexpr StageKind kKind = StageKind::Beliefs;

  void applyProfile(Profile profile) override {
    if (profile != Profile::Paper) return;
    range_floor_cells_ = 0.0;
    dense_groups_ = false;
    doubt_spreads_ = true;
  }
  void declare(ParameterTable& table) override;
  void configure(const RunSettings& settings) override {
    threads_ = settings.threads;
    if (resolution_) setParams(*resolution_);
  }
  void adapt(const CloudScale& scale) override {
    if (!resolution_) resolution_ = automaticResolution(scale);
    noise_.adapt(scale);
    beliefs_.occupancy.noise = noise_.noise();
    if (!scale.optical) beliefs_.occupancy.optical_axis = Vector3::Zero();
    setParams(*resolution_);
  }
  void process(Frame& frame) override;

 private:
  void setParams(double resolution);
  void judgeByTracks(Frame& frame);
  void judgeByCells(Frame& frame);
  std::optional<FrameMotion> motionOf(const Frame& frame) const;

  FeatureBeliefParams beliefs_;
  std::optional<double> resolution_ = 0.1;
  double range_floor_cells_ = 0.5;
  int features_per_cell_ = 8;
  int threads_ = 1;
  bool dense_groups_ = true;
  bool doubt_spreads_ = false;
  FeatureSource source_ = FeatureSource::Auto;
  detail::NoiseKeys noise_;

  CellBeliefs cells_;
  KeyFeatureBeliefs tracks_;
  std::vector<std::int32_t> labels_;  ///< of the frame; kept for its memory
  struct Before {
    std::size_t number = 0;
    Pose T_world_sensor = Pose::Identity();
  };
  std::optional<Before> before_;  ///< the last frame judged by tracks
};

void KlOccupancyStage::declare(ParameterTable& table) {
  table.number("resolution_m", resolution_, Range::positive(),
               "side of the cell whose features make a group and keep one identity; auto = the "
               "automatic resolution");
  table.word("features", source_,
             {{"auto", FeatureSource::Auto},
              {"tracks", FeatureSource::Tracks},
              {"cells", FeatureSource::Cells}},
             "tracks = key features of the images, cells = sampled from the cloud, with the cell "
             "as identity; auto = tracks in frames that have key features, else cells");
  table.word("motion_reading", beliefs_.motion_reading,
             {{"feature", MotionReading::FeaturePosition}, {"pose", MotionReading::RobotPose}},
             "x of Eq. 9, for tracks: the position of the feature or the pose of the robot");
  table.word("update", beliefs_.update.rule,
             {{"kl", UpdateRule::KullbackLeibler},
              {"log_odds", UpdateRule::LogOdds},
              {"none", UpdateRule::None}},
             "kl = Eq. 5-10; [ours] log_odds = the classical update, none = the newest sighting "
             "alone, both as comparison");
  table.integer("features_per_cell", features_per_cell_, Range::between(1, 1000),
                "[ours] features sampled in each cell");
  table.flag("dense_groups", dense_groups_,
             "[ours] Eq. 4 judges tracks together with points of their cell; false = the paper");
  table.flag("doubt_spreads", doubt_spreads_,
             "[ours] doubt in a track spreads to adjacent cells although believed ones are within "
             "reach");
  noise_.declare(table);
  table.number("eta1", beliefs_.occupancy.eta1, Range::above(0.0, 1.0),
               "belief at the peak of Eq. 4");
  table.number("single_feature_probability", beliefs_.occupancy.single_feature_probability,
               Range::between(0.0, 1.0), "[ours] belief in a feature alone in its cell");
  table.number("range_floor_cells", range_floor_cells_, Range::atLeast(0.0),
               "[ours] dr of Eq. 4 is at least this many cells; 0 = the paper");
  table.number("eta2", beliefs_.update.eta2, Range::above(0.0, 1.0), "normalisation of Eq. 7");
  table.number("eta3", beliefs_.update.eta3, Range::above(0.0, 1.0), "normalisation of Eq. 10");
  table.number("bias", beliefs_.update.bias, Range::atLeast(0.0), "A of Eq. 10");
  LogOddsParams& odds = beliefs_.update.log_odds;
  table.number("log_odds_hit", odds.hit, Range::between(0.0, 1.0),
               "probability a hit stands for, between 0.5 and 1");
  table.number("log_odds_miss", odds.miss, Range::between(0.0, 1.0),
               "probability a miss stands for, between 0 and 0.5");
  table.number("log_odds_min", odds.min_probability, Range::between(0.0, 1.0),
               "log-odds are kept above those of this probability, between 0 and 0.5");
  table.number("log_odds_max", odds.max_probability, Range::between(0.0, 1.0),
               "log-odds are kept below those of this probability, between 0.5 and 1");
  table.integer("max_unseen_frames", beliefs_.max_unseen_frames, Range::atLeast(0),
                "[ours] features not seen for so many frames are forgotten; 0 = never");
}

void KlOccupancyStage::setParams(double resolution) {
  beliefs_.occupancy.min_range_error = range_floor_cells_ * resolution;
  CellBeliefParams cells;
  cells.occupancy = beliefs_.occupancy;
  cells.update = beliefs_.update;
  cells.resolution = resolution;
  cells.features_per_cell = features_per_cell_;
  cells.max_unseen_frames = beliefs_.max_unseen_frames;
  cells.threads = threads_;
  cells_.setParams(cells);
  KeyFeatureBeliefParams tracks;
  tracks.beliefs = beliefs_;
  tracks.resolution = resolution;
  tracks.dense_groups = dense_groups_;
  tracks.doubt_spreads = doubt_spreads_;
  tracks.dense_per_cell = features_per_cell_;
  tracks.threads = threads_;
  tracks_.setParams(tracks);
}

/// Since the last frame judged by tracks, which is not the one before if that was skipped.
std::optional<FrameMotion> KlOccupancyStage::motionOf(const Frame& frame) const {
  if (!before_) return std::nullopt;
  if (frame.motion && frame.number == before_->number + 1) return frame.motion;
  FrameMotion motion;
  motion.T_now_before = frame.T_world_sensor.inverse() * before_->T_world_sensor;
  if (frame.motion) motion.covariance = frame.motion->covariance;
  return motion;
}

void KlOccupancyStage::judgeByTracks(Frame& frame) {
  KeyFeatureBeliefs::Frame of;
  of.points = viewOf(*frame.cloud);
  of.indices = &frame.indices;
  of.labels = &labels_;
  of.T_world_sensor = frame.T_world_sensor;
  of.features = &frame.key_features;
  of.motion = motionOf(frame);
  const KeyFeatureBeliefs::Summary seen = tracks_.update(of, frame.probability);
  frame.features = seen.features.created + seen.features.updated;
  frame.matches = seen.features.updated;
  before_ = Before{frame.number, frame.T_world_sensor};
}

void KlOccupancyStage::judgeByCells(Frame& frame) {
  const CellBeliefs::Summary seen = cells_.update(viewOf(*frame.cloud), frame.indices, labels_,
                                                  frame.T_world_sensor, frame.probability);
  frame.features = seen.created + seen.updated;
  frame.matches = seen.updated;
}

void KlOccupancyStage::process(Frame& frame) {
  labels_.assign(frame.cloud->size(), -1);
  for (std::size_t plane = 0; plane < frame.planes.size(); ++plane) {
    for (const int i : frame.planes[plane].inliers) {
      labels_[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(plane);
    }
  }
  frame.probability.assign(frame.cloud->size(), 0.0f);
  const bool by_tracks = source_ == FeatureSource::Tracks ||
                         (source_ == FeatureSource::Auto && !frame.key_features.empty());
  if (by_tracks) {
    judgeByTracks(frame);
  } else {
    judgeByCells(frame);
  }
}

}  // namespace

namespace detail {

void addKlOccupancy(StageTable& table) {
  table.add<KlOccupancyStage>();
}

}  // namespace detail
}  // namespace planar_mapping
