// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/filters/ground_removal.h"

#include "planar_mapping/pipeline/noise_keys.h"
#include "planar_mapping/pipeline/stages/builtin.h"

namespace planar_mapping {
namespace {

class GroundRemovalStage : public Stage {
 public:
  static constexpr const char* kName = "ground_removal";
  static constexpr const char* kSummary =
      "removes the ground (the paper, III-F); its points still clear the space above them";
  static constexpr StageKind kKind = StageKind::Points;

  void applyProfile(Profile profile) override {
    if (profile == Profile::Paper) params_.camera_height = GroundParams::kPaperCameraHeight;
  }
  void declare(ParameterTable& table) override {
    table.number("camera_height_m", params_.camera_height, Range::atLeast(0.0),
                 "height of the sensor over the ground; 0 = unknown in every frame; auto = by the "
                 "pose, from where the ground was in the frames before; the paper's is 0.37 m");
    table.number("height_tolerance_m", params_.height_tolerance, Range::positive(),
                 "[ours] of the height");
    table.vector(
        "up", params_.up,
        "vertical of the world; auto = the axis next to upwards in the images of a camera, "
        "on average over the given poses, or what the planes of the first say where they "
        "lean against that axis; else z");
    table.vector("optical_axis", params_.optical_axis,
                 "direction the camera looks in, sensor frame");
    table.number("pitch_tolerance_deg", params_.pitch_tolerance, Range::above(0.0, 89.0),
                 "[ours] about the lateral axis");
    table.number("roll_tolerance_deg", params_.roll_tolerance, Range::above(0.0, 89.0),
                 "[ours] about the axis forwards");
    table.number("distance_threshold_m", params_.distance_threshold, Range::positive(),
                 "[ours] points this close to the ground belong to it");
    noise_.declareOptional(table, "the threshold follows the stereo noise");
    table.number("noise_factor", params_.noise_factor, Range::atLeast(0.0),
                 "[ours] of the noise model");
    table.number("slope_cell_m", params_.slope_cell, Range::atLeast(0.0),
                 "[ours] side of the cells in which the ground may bend; 0 = one plane only");
    table.number("max_slope_deg", params_.max_slope, Range::between(0.0, 90.0),
                 "[ours] steepest ground, against the plane at the sensor");
    table.number("wall_height_m", params_.wall_height, Range::atLeast(0.0),
                 "[ours] a surface that continues this far above the ground is a wall and keeps "
                 "its foot; 0 = off");
    table.number("wall_cell_m", params_.wall_cell, Range::positive(),
                 "[ours] side of the columns in which walls are looked for");
    table.number("wall_foot_threshold_m", params_.wall_foot_threshold, Range::positive(),
                 "[ours] the threshold in a column with a wall");
    table.number("min_fraction", params_.min_fraction, Range::above(0.0, 1.0),
                 "[ours] fraction of the points that must support the ground");
    table.integer("min_points", params_.min_points, Range::atLeast(3),
                  "[ours] points that must support the ground");
    table.integer("sample_size", params_.sample_size, Range::atLeast(100),
                  "[ours] points the estimate looks at");
    table.basic({"camera_height_m", "up", "optical_axis", "distance_threshold_m"});
  }
  void configure(const RunSettings& settings) override {
    if (settings.up) params_.up = settings.up;
    params_.seed = settings.seed;
    params_.threads = settings.threads;
    params_.validate();
  }
  void adapt(const CloudScale& scale) override {
    if (!params_.up) params_.up = scale.up;
    noise_.adapt(scale);
    params_.noise = noise_.optionalNoise();
    filter_.setParams(params_);
  }
  void process(Frame& frame) override {
    filter_.setInputCloud(frame.cloud);
    filter_.setIndices(detail::sharedIndices(frame.indices));
    filter_.setSensorPose(frame.T_world_sensor);
    filter_.filter(frame.indices);
    const pcl::Indices& removed = *filter_.getRemovedIndices();
    frame.ground.insert(frame.ground.end(), removed.begin(), removed.end());
    if (filter_.getGround().found) return;
    frame.notes.push_back(frame.source +
                          ": no ground: " + toString(filter_.getDiagnostics().status));
  }

 private:
  GroundParams params_;
  detail::NoiseKeys noise_;
  GroundRemoval<pcl::PointXYZ> filter_{true};
};

}  // namespace

void detail::addGroundRemoval(StageTable& table) {
  table.add<GroundRemovalStage>();
}

}  // namespace planar_mapping
