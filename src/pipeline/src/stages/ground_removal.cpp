// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "../marked_indices.h"
#include "builtin.h"
#include "noise_keys.h"
#include "planar_mapping/core/ground/ground.h"

namespace planar_mapping {
namespace {

class GroundRemovalStage : public Stage {
 public:
  static constexpr const char* kName = "ground_removal";
  static constexpr const char* kSummary =
      "removes the ground (the paper, III-F); its points still clear the space above them";
  static constexpr StageKind kKind = StageKind::Points;

  void applyProfile(Profile profile) override {
    if (profile == Profile::Paper) camera_height_ = GroundParams().camera_height;
  }
  void declare(ParameterTable& table) override {
    table.number("camera_height_m", camera_height_, Range::atLeast(0.0),
                 "height of the sensor over the ground; 0 = unknown in every frame; auto = by the "
                 "pose, from where the ground was in the frames before; the paper's is 0.37 m");
    table.number("height_tolerance_m", params_.height_tolerance, Range::positive(),
                 "[ours] of the height");
    table.vector(
        "up", up_,
        "vertical of the world; auto = the axis next to upwards in the first image of a camera, "
        "else z");
    table.vector("optical_axis", params_.optical_axis,
                 "direction the camera looks in, sensor frame");
    table.number("pitch_tolerance_deg", params_.pitch_tolerance, Range::above(0.0, 89.0),
                 "[ours] about the lateral axis");
    table.number("roll_tolerance_deg", params_.roll_tolerance, Range::above(0.0, 89.0),
                 "[ours] about the axis forwards");
    table.number("distance_threshold_m", params_.distance_threshold, Range::positive(),
                 "[ours] points so close to the ground belong to it");
    noise_.declareOptional(table, "the threshold follows the stereo noise");
    table.number("noise_factor", params_.noise_factor, Range::atLeast(0.0),
                 "[ours] of the noise model");
    table.number("slope_cell_m", params_.slope_cell, Range::atLeast(0.0),
                 "[ours] side of the cells in which the ground may bend; 0 = one plane only");
    table.number("max_slope_deg", params_.max_slope, Range::between(0.0, 90.0),
                 "[ours] steepest ground, against the plane at the sensor");
    table.number("wall_height_m", params_.wall_height, Range::atLeast(0.0),
                 "[ours] what goes up at least so far is no ground, nor is its foot; 0 = off");
    table.number("wall_cell_m", params_.wall_cell, Range::positive(),
                 "[ours] side of the column in which that is judged");
    table.number("wall_foot_threshold_m", params_.wall_foot_threshold, Range::positive(),
                 "[ours] the threshold in a column with a wall");
    table.number("min_share", params_.min_share, Range::above(0.0, 1.0),
                 "[ours] share of the points that must support the ground");
    table.integer("min_points", params_.min_points, Range::atLeast(3),
                  "[ours] points that must support the ground");
    table.integer("sample_size", params_.sample_size, Range::atLeast(100),
                  "[ours] points the estimate looks at");
  }
  void configure(const RunSettings& settings) override {
    params_.seed = settings.seed;
    params_.threads = settings.threads;
    params_.camera_height = camera_height_.value_or(0.0);
    params_.validate();
  }
  void adapt(const CloudScale& scale) override {
    if (!up_) up_ = scale.up;
    noise_.adapt(scale);
    params_.noise = noise_.optionalNoise();
    params_.validate();
  }
  void process(Frame& frame) override {
    GroundParams params = params_;
    params.up = frame.T_world_sensor.linear().transpose() * up_->normalized();
    const PointsView points = viewOf(*frame.cloud);
    const Ground ground = camera_height_ ? findGround(points, &frame.indices, params)
                                         : findFollowed(points, frame, params);
    if (!ground.found) {
      frame.notes.push_back(frame.source + ": no ground: " + toString(ground.diagnostics.status));
      return;
    }
    const std::size_t count = frame.indices.size();
    const std::size_t before = frame.ground.size();
    frame.ground.resize(before + ground.diagnostics.ground_points + 1);
    const std::uint8_t* is_ground = ground.is_ground.data();
    int* indices = frame.indices.data();
    int* removed = frame.ground.data();
    removed = detail::copyMarked(indices, is_ground, count, 1, removed + before);
    int* kept = detail::copyMarked(indices, is_ground, count, 0, indices);
    frame.indices.resize(static_cast<std::size_t>(kept - indices));
    frame.ground.resize(static_cast<std::size_t>(removed - frame.ground.data()));
  }

 private:
  static constexpr std::size_t kFrames = 5;  ///< that must agree on where the ground is

  /// The ground where that of the frames before lets one expect it.
  Ground findFollowed(const PointsView& points, const Frame& frame, GroundParams params) {
    const double altitude = up_->normalized().dot(frame.T_world_sensor.translation());
    if (level_ && altitude - *level_ > params.height_tolerance) {
      params.camera_height = altitude - *level_;
      const Ground ground = findGround(points, &frame.indices, params);
      if (ground.found) {
        level_ = altitude - ground.height;  // slopes and drift are followed
        levels_.clear();
        return ground;
      }
    }
    // What is elsewhere is a table rather than the ground, unless it is there again and again: the
    // camera was lifted without its pose, or the level was a table's.
    params.camera_height = 0.0;
    Ground ground = findGround(points, &frame.indices, params);
    if (!ground.found) return ground;
    learn(altitude - ground.height);
    if (!level_ || std::fabs(altitude - ground.height - *level_) <= params.height_tolerance) {
      return ground;
    }
    Ground none;
    none.is_ground.assign(ground.is_ground.size(), 0);
    none.diagnostics = ground.diagnostics;
    none.diagnostics.status = GroundStatus::NoPlane;
    none.diagnostics.ground_points = 0;
    return none;
  }

  /// Takes the median of the last levels for that of the ground if they agree.
  void learn(double level) {
    levels_.push_back(level);
    if (levels_.size() < kFrames) return;
    std::vector<double> sorted = levels_;
    std::sort(sorted.begin(), sorted.end());
    levels_.erase(levels_.begin());
    if (sorted.back() - sorted.front() > params_.height_tolerance) return;
    level_ = sorted[kFrames / 2];
    levels_.clear();
  }

  GroundParams params_;
  std::optional<double> camera_height_;
  std::optional<double> level_;  ///< of the ground, along the vertical of the world, metres
  std::vector<double> levels_;   ///< of the last frames whose ground is not at level_
  std::optional<Vector3> up_;
  detail::NoiseKeys noise_;
};

}  // namespace

namespace detail {

void addGroundRemoval(StageTable& table) {
  table.add<GroundRemovalStage>();
}

}  // namespace detail
}  // namespace planar_mapping
