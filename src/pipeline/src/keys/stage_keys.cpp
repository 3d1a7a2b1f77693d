// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "keys/stage_keys.h"

#include <algorithm>
#include <limits>
#include <string>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::detail {

void NoiseKeys::declare(ParameterTable& table) {
  table.number("baseline_m", baseline_, Range::positive(),
               "B of the noise model; auto = of calib.yaml, else 0.12");
  table.number("focal_length_px", focal_length_, Range::positive(),
               "f of the noise model; auto = of calib.yaml, else 500");
  table.number("disparity_error_px", disparity_error_, Range::atLeast(0.0),
               "dd of the noise model");
}

void NoiseKeys::declareOptional(ParameterTable& table, const char* use) {
  table.word("noise", source_,
             {{"auto", Source::Auto}, {"none", Source::None}, {"given", Source::Given}},
             std::string("[ours] ") + use +
                 "; none, given = by the next three keys, auto = given if the input has a stereo "
                 "calibration, else none");
  declare(table);
}

void NoiseKeys::adapt(const CloudScale& scale) {
  if (source_ == Source::Auto) source_ = scale.stereo ? Source::Given : Source::None;
  const StereoNoise known = scale.stereo.value_or(StereoNoise());
  if (!baseline_) baseline_ = known.baseline;
  if (!focal_length_) focal_length_ = known.focal_length;
}

std::optional<StereoNoise> NoiseKeys::optionalNoise() const {
  if (source_ != Source::Given) return std::nullopt;
  return noise();
}

StereoNoise NoiseKeys::noise() const {
  StereoNoise noise;
  noise.baseline = baseline_.value_or(noise.baseline);
  noise.focal_length = focal_length_.value_or(noise.focal_length);
  noise.disparity_error = disparity_error_;
  return noise;
}

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

void PlaneKeys::applyProfile(Profile profile) {
  if (profile != Profile::Paper) return;
  params.method = PlaneSearchMethod::MultiRansac;
  params.source = PlaneSource::Features;
  params.features.refine = false;
  assumed_probability = 0.0;
  noise.setSource(NoiseKeys::Source::None);
}

void PlaneKeys::declare(ParameterTable& table) {
  table.word("method", params.method,
             {{"automatic", PlaneSearchMethod::Automatic},
              {"multi_ransac", PlaneSearchMethod::MultiRansac},
              {"sequential", PlaneSearchMethod::Sequential},
              {"organized", PlaneSearchMethod::Organized},
              {"disparity", PlaneSearchMethod::Disparity}},
             "how planes are looked for");
  table.word("source", params.source,
             {{"dense", PlaneSource::Dense},
              {"features", PlaneSource::Features},
              {"auto", PlaneSource::Auto}},
             "what planes are found in: the dense points, the key features, whose planes the "
             "dense points are then given to (Eq. 11), or auto = the key features and then the "
             "dense points on none of their planes");
  table.integer("features", params.features.samples, Range::atLeast(8),
                "points sampled evenly from the cloud in place of key features, where a frame "
                "has none");
  table.integer("min_features", params.features.min_features, Range::atLeast(3),
                "[ours] key features on a plane, fewer could be chance");
  table.flag("refine", params.features.refine,
             "[ours] planes of key features keep only points that are a surface and are refitted "
             "to them; without, dense points only belong, as in the paper");
  table.number("distance_threshold_m", distance_threshold, Range::positive(),
               "d_T, Eq. 11; auto = half the automatic resolution");
  table.integer("min_inliers", min_inliers, Range::atLeast(3),
                "smallest plane that counts; auto = a 300th of the points, at least 50");
  table.integer("max_planes", params.max_planes, Range::atLeast(0), "0 = as many as there are");
  noise.declareOptional(table,
                        "the threshold follows the stereo noise, max(d_T, noise_factor * dz(z))");
  table.number("noise_factor", params.noise_factor, Range::atLeast(0.0), "k of the noise model");
  table.number("patch_gap_m", params.patch_gap, Range::atLeast(0.0),
               "[ours] points of one plane farther apart are separate patches; 0 = from the "
               "density");
  table.integer("number_of_models", params.number_of_models, Range::atLeast(0),
                "W of multi-RANSAC; 0 = by significance");
  table.integer("max_iterations", params.max_iterations, Range::atLeast(0),
                "of the random search; 0 = from the miss probability");
  table.number("miss_probability", params.miss_probability, Range::above(0.0, 0.5),
               "chance to miss a plane that is there");
  table.number("significance", params.significance, Range::atLeast(0.0),
               "[ours] standard deviations by which a plane must exceed clutter");
  table.number("max_normal_deviation_deg", params.max_normal_deviation, Range::above(0.0, 90.0),
               "[ours] largest angle between a plane and the surface at its points");
  table.number("assumed_probability", assumed_probability, Range::between(0.0, 1.0),
               "[ours] belief in a plane where a stereo camera measures nothing between its "
               "points, as the image is even: a white wall; 0 = none");
  table.basic({"source", "distance_threshold_m", "min_inliers", "noise", "noise_factor"});
}

void PlaneKeys::configure(const RunSettings& settings) {
  params.seed = settings.seed;
  params.threads = settings.threads;
  params.validate();
}

void PlaneKeys::adapt(const CloudScale& scale) {
  constexpr std::size_t kSmallest = 50;
  constexpr std::size_t kFraction = 300;
  if (!distance_threshold) distance_threshold = 0.5 * automaticResolution(scale);
  if (!min_inliers) {
    min_inliers = static_cast<int>(std::max(kSmallest, scale.points / kFraction));
  }
  up = scale.up;
  noise.adapt(scale);
  params.noise = noise.optionalNoise();
  params.distance_threshold = *distance_threshold;
  params.min_inliers = *min_inliers;
  params.validate();
}

namespace {

constexpr double kMostMetres = 1e6;
constexpr double kMaxCells = 2048.0;  // of space that the map keeps track of, from the sensor

/// Coordinates are floats: far from 0 they are coarser than what is to be mapped.
void requirePrecision(double range, double resolution) {
  constexpr double kSteps = 8.0;  // of a coordinate in a cell, at least
  const double step = range * std::numeric_limits<float>::epsilon();
  if (kSteps * step <= resolution) return;
  throw InputError("coordinates reach " + formatNumber(range) +
                   " m, where a float knows steps of " + formatNumber(step) +
                   " m, too coarse for cells of " + formatNumber(resolution) +
                   " m; save x, y, z as doubles (PCD: SIZE 8, PLY: double), or shift the cloud to "
                   "its own place before it is rounded");
}

}  // namespace

void MapKeys::applyProfile(Profile profile) {
  params = PlanarMapParams::of(profile);
  if (profile == Profile::Paper) noise.setSource(NoiseKeys::Source::None);
}

void MapKeys::declare(ParameterTable& table) {
  CuboidApproximationParams& approximation = params.approximation;
  table.number("resolution_m", resolution, Range::positive(),
               "s, side of the smallest cell; auto = a hundredth of the cloud's extent or three "
               "point spacings, the larger, at most 0.2 m, but at least two (of more than "
               "1 m three) and four times the noise");
  table.number("thickness_m", approximation.thickness, Range::atLeast(0.0),
               "extension behind the surface; 0 = resolution_m");
  table.number("density_threshold", approximation.density_threshold, Range::above(0.0, 1.0),
               "D_T of the split");
  table.number("min_width_m", approximation.min_width, Range::atLeast(0.0),
               "W_T of the split; 0 = resolution_m");
  table.number("min_height_m", approximation.min_height, Range::atLeast(0.0),
               "H_T of the split; 0 = resolution_m");
  table.integer("min_points_per_cell", approximation.min_points_per_cell, Range::atLeast(1),
                "cells with fewer points are empty");
  table.number("hole_size_m", approximation.hole_size, Range::atLeast(0.0),
               "[ours] compact: holes up to this side are filled; 0 = one cell, less than "
               "resolution_m = none");
  table.number("absorption_cells", approximation.absorption, Range::between(0.0, 0.5),
               "[ours] compact: a cuboid stands for what lies within so many cells of it; less "
               "than 0.5 = cuboids cover all cells exactly");
  table.number("rectangle_cells", approximation.rectangle_cells, Range::atLeast(0.0),
               "[ours] compact: a plane's rectangle of fewer cells of its own is left to "
               "axis-aligned boxes");
  table.vector("up", up,
               "vertical of the world, for horizontal edges; auto = the axis next to upwards in "
               "the images of a camera, on average over the given poses, or what the planes of "
               "the first say where they lean against that axis; else z");
  table.number("association_angle_deg", params.association_angle, Range::above(0.0, 90.0),
               "[ours] largest angle between a new plane and its plane in the map");
  table.number("association_offset_m", association_offset, Range::above(0.0, kMostMetres),
               "[ours] largest offset between them; auto = resolution_m");
  table.number("association_gap_m", association_gap, Range::between(0.0, kMostMetres),
               "[ours] largest gap between their patches; auto = five times resolution_m");
  table.word(
      "unknown_space", unknown_space,
      {{"auto", UnknownSpace::Auto}, {"true", UnknownSpace::Yes}, {"false", UnknownSpace::No}},
      "keep track of free and unknown space (Fig. 5c); auto = unless the cloud is merged of many "
      "scans, whose rays mean nothing");
  table.word("unseen", params.unseen, {{"unknown", Unseen::Unknown}, {"free", Unseen::Free}},
             "[ours] what space is that no frame saw; free = all but what lies behind "
             "something (the paper)");
  table.number("unknown_resolution_m", params.unknown_resolution, Range::atLeast(0.0),
               "side of a cell of free or unknown space; 0 = resolution_m");
  table.number("max_range_m", max_range, Range::above(0.0, kMostMetres),
               "frames say what space is up to this depth, at most 2,048 cells of space; auto = as "
               "far as they measure, with "
               "unseen: free as far as points are mapped (miss_range_m)");
  table.number("miss_range_m", miss_range, Range::above(0.0, kMostMetres),
               "[ours] cells up to this depth lose belief by miss_factor; auto = as far as "
               "depth_error_limit lets points be mapped, without it 99 % of the points are "
               "nearer; at most max_range_m");
  table.number("min_probability", params.min_probability, Range::between(0.0, 1.0),
               "[ours] cells believed less than this are removed");
  table.number("belief_gain", params.belief_gain, Range::above(0.0, 1.0),
               "[ours] fraction of the newest frame in a cell's belief");
  table.number(
      "miss_factor", params.miss_factor, Range::between(0.0, 1.0),
      "[ours] a cell's belief is multiplied by this when it is looked through or not confirmed");
  table.number(
      "first_belief", params.first_belief, Range::above(0.0, 1.0),
      "[ours] most belief a cell gets from one frame, but for those of the first sight of a "
      "plane");
  table.number("min_cell_fraction", params.min_cell_fraction, Range::between(0.0, 1.0),
               "[ours] a cell is seen if it holds this fraction of the points of a full one; where "
               "the camera is known, and in scans after the first");
  table.number("rim_pixels", params.rim_pixels, Range::between(0.0, 1e6),
               "[ours] or that of a strip of so many pixels and the depth error, if that is less");
  table.number("surface_factor", params.surface_factor, Range::between(0.0, 10.0),
               "[ours] compact: cuboids reach so many root mean square distances of their "
               "plane's points before and behind it, at most 0.45 (0.75 where that is five cells) "
               "and 0.75 of a cell");
  noise.declareOptional(table, "points within noise_factor depth errors of a plane make no cell");
  table.number("noise_factor", params.noise_factor, Range::between(0.0, 10.0),
               "[ours] depth errors along its ray that a point may be off its plane");
  table.number("refit_tolerance_cells", params.refit_tolerance, Range::between(0.0, 1e6),
               "[ours] cells follow a refit of their plane that moves them by more");
  table.number("range_image_step_deg", params.range_image_step, Range::between(0.06, 28.0),
               "[ours] pixel of the spherical image, for clouds of no camera");
  table.basic({"resolution_m", "absorption_cells", "up", "association_offset_m", "unknown_space",
               "unseen", "max_range_m", "min_probability", "miss_factor", "first_belief",
               "min_cell_fraction"});
}

void MapKeys::configure(int threads) {
  params.approximation.threads = threads;
  if (resolution) params.approximation.resolution = *resolution;
  params.validate();
}

void MapKeys::adapt(const CloudScale& scale) {
  if (!resolution) resolution = automaticResolution(scale);
  requirePrecision(scale.max_range, *resolution);
  if (!association_offset) association_offset = *resolution;
  if (!association_gap) association_gap = 5.0 * *resolution;
  const double mapped = withinLimit(scale.depth_limit.value_or(scale.max_range));
  if (!miss_range) miss_range = max_range.value_or(mapped);
  // Free space ends where measurements do. What is hidden beyond what is mapped would be borders,
  // as noisy as the depths, of nothing in the map.
  if (max_range) {
    max_range = std::min(*max_range, withinLimit(kMostMetres));
  } else {
    max_range = withinLimit(params.unseen == Unseen::Free ? mapped : kMaxCells * *resolution);
  }
  if (!up) up = scale.up;
  if (unknown_space == UnknownSpace::Auto) {
    unknown_space = scale.has_sensor ? UnknownSpace::Yes : UnknownSpace::No;
  }
  params.unknown_space = unknown_space == UnknownSpace::Yes;
  noise.adapt(scale);
  params.approximation.resolution = *resolution;
  params.approximation.up = up->normalized();
  params.association_offset = *association_offset;
  params.association_gap = *association_gap;
  params.max_range = *max_range;
  params.miss_range = *miss_range;
  params.validate();
}

double MapKeys::withinLimit(double range) const {
  const double unknown = params.unknown_resolution;
  const double cell = unknown > 0.0 ? unknown : *resolution;
  return std::clamp(range, cell, kMaxCells * cell);
}

}  // namespace planar_mapping::detail
