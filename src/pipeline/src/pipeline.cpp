// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/pipeline.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace planar_mapping {
namespace {

using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Neither NaN nor infinite, and near enough that its square stays finite in a float.
bool isUsable(const pcl::PointXYZ& p) {
  constexpr float kFarthest = 1e12f;
  return std::abs(p.x) <= kFarthest && std::abs(p.y) <= kFarthest && std::abs(p.z) <= kFarthest;
}

}  // namespace

Pipeline::Pipeline(Configuration configuration) : configuration_(std::move(configuration)) {}

FrameReport Pipeline::process(Frame& frame) {
  return runStages(frame, true);
}

FrameReport Pipeline::replay(Frame& frame) {
  return runStages(frame, false);
}

FrameReport Pipeline::runStages(Frame& frame, bool insert) {
  const Clock::time_point start = Clock::now();
  findUsablePoints(frame);
  std::vector<double> stage_ms(configuration_.stages.size(), 0.0);
  if (frame.indices.empty()) {
    frame.warnings.push_back("no point of " + frame.source + " is finite");
  } else {
    adaptTo(frame);
    frame.map = &map_;
    for (std::size_t i = 0; i < configuration_.stages.size(); ++i) {
      if (!insert && configuration_.stages[i].kind == StageKind::Map) continue;
      const Clock::time_point stage_start = Clock::now();
      configuration_.stages[i].stage->process(frame);
      stage_ms[i] = millisecondsSince(stage_start);
    }
  }
  FrameReport result = report(frame);
  result.stage_ms = std::move(stage_ms);
  result.frame_ms = millisecondsSince(start);
  return result;
}

void Pipeline::continueFrom(PlanarMap map) {
  map_ = std::move(map);
  continued_ = true;
}

void Pipeline::findUsablePoints(Frame& frame) const {
  const FrameCloud& cloud = *frame.cloud;
  frame.points_input = cloud.size();
  frame.indices.clear();
  frame.indices.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (isUsable(cloud[i])) frame.indices.push_back(static_cast<int>(i));
  }
  frame.points_valid = frame.indices.size();
}

void Pipeline::adaptTo(const Frame& frame) {
  if (adapted_) return;
  adapted_ = true;
  CloudScale scale = scaleOf(*frame.cloud, frame.indices, frame.T_world_sensor);
  if (frame.camera && frame.baseline) {
    scale.stereo = StereoNoise();
    scale.stereo->baseline = *frame.baseline;
    scale.stereo->focal_length = frame.camera->fx;
  }
  for (ConfiguredStage& stage : configuration_.stages) stage.stage->adapt(scale);
  if (continued_) return;
  PlanarMapParams params;
  for (const ConfiguredStage& stage : configuration_.stages) stage.stage->configureMap(params);
  map_ = PlanarMap(params);
}

FrameReport Pipeline::report(const Frame& frame) const {
  FrameReport report;
  report.number = frame.number;
  report.source = frame.source;
  report.timestamp = frame.timestamp;
  report.points_input = frame.points_input;
  report.points_valid = frame.points_valid;
  report.points_ground = frame.ground.size();
  for (const PlaneSegment& plane : frame.planes) report.points_planar += plane.inliers.size();
  report.points_planar = std::min(report.points_planar, frame.indices.size());
  report.points_non_planar = frame.indices.size() - report.points_planar;
  const std::size_t kept = frame.indices.size() + frame.ground.size();
  report.points_rejected = frame.points_valid - std::min(frame.points_valid, kept);
  report.features = frame.features;
  report.matches = frame.matches;
  report.planes = frame.planes.size();
  report.planes_new = frame.update.planes_new;
  report.planes_matched = frame.update.planes_matched;
  report.cuboids = map_.cuboids().size();
  report.map_bytes = map_.memoryBytes();
  return report;
}

}  // namespace planar_mapping
