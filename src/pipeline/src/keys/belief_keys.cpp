// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "keys/belief_keys.h"

namespace planar_mapping::detail {

void BeliefKeys::applyProfile(Profile profile) {
  if (profile != Profile::Paper) return;
  params.range_floor_cells = 0.0;
  params.dense_groups = false;
  params.doubt_spreads = true;
}

void BeliefKeys::declare(ParameterTable& table) {
  table.number("resolution_m", resolution, Range::positive(),
               "side of the cell whose features make a group and keep one identity; auto = the "
               "automatic resolution");
  table.word("features", params.source,
             {{"auto", FeatureSource::Auto},
              {"tracks", FeatureSource::Tracks},
              {"cells", FeatureSource::Cells}},
             "tracks = key features of the images, cells = sampled from the cloud, with the cell "
             "as identity; auto = tracks in frames that have key features, else cells");
  table.word("motion_reading", params.beliefs.motion_reading,
             {{"feature", MotionReading::FeaturePosition}, {"pose", MotionReading::RobotPose}},
             "x of Eq. 9, for tracks: the position of the feature or the pose of the robot");
  table.word("update", params.beliefs.update.rule,
             {{"kl", UpdateRule::KullbackLeibler},
              {"log_odds", UpdateRule::LogOdds},
              {"none", UpdateRule::None}},
             "kl = Eq. 5-10; [ours] log_odds = the classical update, none = the newest sighting "
             "alone, both as comparison");
  table.integer("features_per_cell", params.features_per_cell, Range::between(1, 1000),
                "[ours] features sampled in each cell");
  table.flag("dense_groups", params.dense_groups,
             "[ours] Eq. 4 is over tracked features and points of their cell; false = over "
             "features, the paper");
  table.flag(
      "doubt_spreads", params.doubt_spreads,
      "[ours] doubt in a track spreads to adjacent cells although believed ones are within reach");
  noise.declare(table);
  table.number("eta1", params.beliefs.occupancy.eta1, Range::above(0.0, 1.0),
               "belief at the peak of Eq. 4");
  table.number("single_feature_probability", params.beliefs.occupancy.single_feature_probability,
               Range::between(0.0, 1.0), "[ours] belief in a feature alone in its cell");
  table.number("range_floor_cells", params.range_floor_cells, Range::atLeast(0.0),
               "[ours] dr of Eq. 4 is at least this many cells; 0 = the paper");
  table.number("eta2", params.beliefs.update.eta2, Range::above(0.0, 1.0),
               "normalisation of Eq. 7");
  table.number("eta3", params.beliefs.update.eta3, Range::above(0.0, 1.0),
               "normalisation of Eq. 10");
  table.number("bias", params.beliefs.update.bias, Range::atLeast(0.0), "A of Eq. 10");
  LogOddsParams& odds = params.beliefs.update.log_odds;
  table.number("log_odds_hit", odds.hit, Range::between(0.0, 1.0),
               "probability a hit stands for, between 0.5 and 1");
  table.number("log_odds_miss", odds.miss, Range::between(0.0, 1.0),
               "probability a miss stands for, between 0 and 0.5");
  table.number("log_odds_min", odds.min_probability, Range::between(0.0, 1.0),
               "log-odds are kept above those of this probability, between 0 and 0.5");
  table.number("log_odds_max", odds.max_probability, Range::between(0.0, 1.0),
               "log-odds are kept below those of this probability, between 0.5 and 1");
  table.integer("max_unseen_frames", params.beliefs.max_unseen_frames, Range::atLeast(0),
                "[ours] features not seen for this many frames are forgotten; 0 = never");
  table.basic({"resolution_m", "features", "update"});
}

void BeliefKeys::configure(const RunSettings& settings) {
  params.threads = settings.threads;
  if (!resolution) return;
  params.resolution = *resolution;
  params.validate();
}

void BeliefKeys::adapt(const CloudScale& scale) {
  if (!resolution) resolution = automaticResolution(scale);
  params.resolution = *resolution;
  noise.adapt(scale);
  params.beliefs.occupancy.noise = noise.noise();
  if (!scale.optical) params.beliefs.occupancy.optical_axis = Vector3::Zero();
}

}  // namespace planar_mapping::detail
