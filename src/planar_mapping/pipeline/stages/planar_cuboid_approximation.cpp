// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "planar_mapping/pipeline/noise_keys.h"
#include "planar_mapping/pipeline/rounded.h"
#include "planar_mapping/pipeline/stages/builtin.h"
#include "planar_mapping/surface/planar_mapping.h"

namespace planar_mapping {
namespace {

constexpr double kMostMetres = 1e6;

class PlanarCuboidApproximationStage : public Stage {
 public:
  static constexpr const char* kName = "planar_cuboid_approximation";
  static constexpr const char* kSummary =
      "turns planes and other points into oriented cuboids of the map (the paper, III-F and IV)";
  static constexpr StageKind kKind = StageKind::Map;

  void applyProfile(Profile profile) override {
    params_ = PlanarMapParams::of(profile);
    if (profile == Profile::Paper) noise_.setSource(detail::NoiseKeys::Source::None);
  }
  void declare(ParameterTable& table) override {
    CuboidApproximationParams& approximation = params_.approximation;
    table.number("resolution_m", resolution_, Range::positive(),
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
    table.vector("up", up_,
                 "vertical of the world, for horizontal edges; auto = the axis next to upwards in "
                 "the images of a camera, on average over the given poses, or what the planes of "
                 "the first say where they lean against that axis; else z");
    table.number("association_angle_deg", params_.association_angle, Range::above(0.0, 90.0),
                 "[ours] largest angle between a new plane and its plane in the map");
    table.number("association_offset_m", association_offset_, Range::above(0.0, kMostMetres),
                 "[ours] largest offset between them; auto = resolution_m");
    table.number("association_gap_m", association_gap_, Range::between(0.0, kMostMetres),
                 "[ours] largest gap between their patches; auto = five times resolution_m");
    table.word(
        "unknown_space", unknown_space_,
        {{"auto", UnknownSpace::Auto}, {"true", UnknownSpace::Yes}, {"false", UnknownSpace::No}},
        "keep track of free and unknown space (Fig. 5c); auto = unless the cloud is merged of many "
        "scans, whose rays mean nothing");
    table.word("unseen", params_.unseen, {{"unknown", Unseen::Unknown}, {"free", Unseen::Free}},
               "[ours] what space is that no frame saw; free = all but what lies behind "
               "something (the paper)");
    table.number("unknown_resolution_m", params_.unknown_resolution, Range::atLeast(0.0),
                 "side of a cell of free or unknown space; 0 = resolution_m");
    table.number(
        "max_range_m", max_range_, Range::above(0.0, kMostMetres),
        "frames say what space is up to this depth, at most 2,048 cells of space; auto = as "
        "far as they measure, with "
        "unseen: free as far as points are mapped (miss_range_m)");
    table.number("miss_range_m", miss_range_, Range::above(0.0, kMostMetres),
                 "[ours] cells up to this depth lose belief by miss_factor; auto = as far as "
                 "depth_error_limit lets points be mapped, without it 99 % of the points are "
                 "nearer; at most max_range_m");
    table.number("min_probability", params_.min_probability, Range::between(0.0, 1.0),
                 "[ours] cells believed less than this are removed");
    table.number("belief_gain", params_.belief_gain, Range::above(0.0, 1.0),
                 "[ours] fraction of the newest frame in a cell's belief");
    table.number(
        "miss_factor", params_.miss_factor, Range::between(0.0, 1.0),
        "[ours] a cell's belief is multiplied by this when it is looked through or not confirmed");
    table.number(
        "first_belief", params_.first_belief, Range::above(0.0, 1.0),
        "[ours] most belief a cell gets from one frame, but for those of the first sight of a "
        "plane");
    table.number(
        "min_cell_fraction", params_.min_cell_fraction, Range::between(0.0, 1.0),
        "[ours] a cell is seen if it holds this fraction of the points of a full one; where "
        "the camera is known, and in scans after the first");
    table.number(
        "rim_pixels", params_.rim_pixels, Range::between(0.0, 1e6),
        "[ours] or that of a strip of so many pixels and the depth error, if that is less");
    table.number(
        "surface_factor", params_.surface_factor, Range::between(0.0, 10.0),
        "[ours] compact: cuboids reach so many root mean square distances of their "
        "plane's points before and behind it, at most 0.45 (0.75 where that is five cells) "
        "and 0.75 of a cell");
    noise_.declareOptional(table,
                           "points within noise_factor depth errors of a plane make no cell");
    table.number("noise_factor", params_.noise_factor, Range::between(0.0, 10.0),
                 "[ours] depth errors along its ray that a point may be off its plane");
    table.number("refit_tolerance_cells", params_.refit_tolerance, Range::between(0.0, 1e6),
                 "[ours] cells follow a refit of their plane that moves them by more");
    table.number("range_image_step_deg", params_.range_image_step, Range::between(0.06, 28.0),
                 "[ours] pixel of the spherical image, for clouds of no camera");
    table.basic({"resolution_m", "absorption_cells", "up", "association_offset_m", "unknown_space",
                 "unseen", "max_range_m", "min_probability", "miss_factor", "first_belief",
                 "min_cell_fraction"});
  }
  void configure(const RunSettings& settings) override {
    if (settings.up) up_ = settings.up;
    params_.approximation.threads = settings.threads;
    if (resolution_) params_.approximation.resolution = *resolution_;
    params_.validate();
  }
  void adapt(const CloudScale& scale) override {
    if (!resolution_) resolution_ = automaticResolution(scale);
    if (!up_) up_ = scale.up;
    params_.setResolution(*resolution_);
    params_.association_offset = association_offset_.value_or(params_.association_offset);
    params_.association_gap = association_gap_.value_or(params_.association_gap);
    params_.approximation.up = *up_;
    params_.max_range = max_range_.value_or(0.0);
    params_.miss_range = miss_range_.value_or(0.0);
    params_.unknown_space = unknown_space_ != UnknownSpace::No;
    CloudScale seen = scale;
    seen.has_sensor = scale.has_sensor || unknown_space_ == UnknownSpace::Yes;
    params_ = params_.resolvedFor(seen);
    params_.validate();
    noise_.adapt(scale);
    // What the configuration that is written with the map says.
    association_offset_ = params_.association_offset;
    association_gap_ = params_.association_gap;
    max_range_ = params_.max_range;
    miss_range_ = params_.miss_range;
    unknown_space_ = params_.unknown_space ? UnknownSpace::Yes : UnknownSpace::No;
  }
  std::optional<double> resolution() const override { return resolution_; }
  void configureMap(PlanarMapParams& params) const override { params = params_; }
  void process(Frame& frame) override {
    mapping_.setMap(*frame.map);
    mapping_.setInputCloud(frame.cloud);
    mapping_.setIndices(detail::sharedIndices(frame.indices));
    mapping_.setSensorPose(frame.T_world_sensor);
    mapping_.setTimestamp(frame.timestamp);
    mapping_.setGroundIndices(frame.ground);
    mapping_.setPlanes(std::move(frame.planes));
    mapping_.setPointProbabilities(std::move(frame.probability));
    mapping_.setAssumedPoints(frame.assumed);
    mapping_.setCamera(frame.camera);
    mapping_.setNoiseModel(noise_.optionalNoise());
    frame.update = mapping_.integrate();
    frame.planes = mapping_.takePlanes();
    frame.probability = mapping_.takePointProbabilities();
    mapping_.setInputCloud(nullptr);
    frame.inserted = true;
    if (std::isfinite(frame.update.space_range)) {
      frame.notes.push_back(frame.source + ": space is classified up to " +
                            detail::rounded(frame.update.space_range, 0) +
                            " m only, all of it would be too much for one frame; a coarser "
                            "unknown_resolution_m reaches farther");
    }
  }

 private:
  enum class UnknownSpace : std::uint8_t { Auto, Yes, No };

  PlanarMapParams params_;
  std::optional<double> resolution_ = 0.1;
  UnknownSpace unknown_space_ = UnknownSpace::Auto;
  std::optional<double> association_offset_;
  std::optional<double> association_gap_;
  std::optional<double> max_range_;
  std::optional<double> miss_range_;
  std::optional<Vector3> up_ = Vector3::UnitZ();
  detail::NoiseKeys noise_;
  PlanarMapping<pcl::PointXYZ> mapping_;
};

}  // namespace

void detail::addPlanarCuboidApproximation(StageTable& table) {
  table.add<PlanarCuboidApproximationStage>();
}

}  // namespace planar_mapping
