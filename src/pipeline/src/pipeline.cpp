// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/pipeline.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <string_view>

namespace planar_mapping {
namespace {

using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// A number for the pictures of a frame and the depth that came with them: the same pictures give
/// the same number, and others hardly ever; noise alone makes pictures differ. 0 without pictures.
std::uint64_t pictureFingerprint(const Frame& frame) {
  if (frame.images.left.empty()) return 0;
  std::uint64_t value = 0;
  const auto add = [&value](const void* bytes, std::size_t size) {
    value = 31 * value + std::hash<std::string_view>()({static_cast<const char*>(bytes), size});
  };
  for (const io::Image* image : {&frame.images.left, &frame.images.right}) {
    add(image->pixels.data(), image->pixels.size());
  }
  // Enough of the depths to see their noise.
  constexpr std::size_t kStep = 16;
  for (std::size_t i = 0; i < frame.cloud->size(); i += kStep) {
    add((*frame.cloud)[i].data, 3 * sizeof(float));
  }
  return value;
}

/// Stages through the last one of these kinds.
std::size_t sizeThrough(const Configuration& configuration,
                        std::initializer_list<StageKind> kinds) {
  std::size_t size = 0;
  for (std::size_t i = 0; i < configuration.stages.size(); ++i) {
    const ConfiguredStage& stage = configuration.stages[i];
    const bool counts = std::find(kinds.begin(), kinds.end(), stage.kind) != kinds.end();
    if (counts && stage.enabled) size = i + 1;
  }
  return size;
}

}  // namespace

Pipeline::Pipeline(Configuration configuration)
    : configuration_(std::move(configuration)),
      front_end_size_(sizeThrough(configuration_, {StageKind::Images, StageKind::Features})),
      sensing_size_(std::max(front_end_size_, sizeThrough(configuration_, {StageKind::Motion}))),
      adapted_(configuration_.stages.size(), false) {}

FrameReport Pipeline::process(Frame& frame) {
  return runSections(frame, Extent::All);
}

FrameReport Pipeline::processFrontEnd(Frame& frame) {
  return runSections(frame, Extent::FrontEnd);
}

FrameReport Pipeline::replay(Frame& frame) {
  return runSections(frame, Extent::WithoutMap);
}

FrameReport Pipeline::runSections(Frame& frame, Extent extent) {
  const Clock::time_point start = Clock::now();
  frame.map = &map_;
  frame.stage_ms.resize(configuration_.stages.size(), 0.0);
  if (!frame.front_end_done) runFrontEnd(frame);
  if (extent != Extent::FrontEnd) {
    findUsablePoints(frame);
    const bool sensed = frame.skip_reason.empty();
    const std::size_t statistics = frame.statistics.size();
    runMapping(frame, extent);
    if (frame.skip_reason.empty()) {
      tryAgain(extent);
    } else if (sensed && mapping_adapted_ && hasStage(StageKind::Motion)) {
      constexpr std::size_t kMostLeftOut = 4;
      left_out_.push_back({frame, 0});
      left_out_.back().frame.statistics.resize(statistics);
      if (left_out_.size() > kMostLeftOut) left_out_.erase(left_out_.begin());
    }
  }
  FrameReport result = report(frame);
  result.frame_ms = millisecondsSince(start);
  return result;
}

void Pipeline::runMapping(Frame& frame, Extent extent) {
  for (std::size_t i = front_end_size_; i < sensing_size_; ++i) runStage(i, frame);
  if (frame.skip_reason.empty()) adaptMapping(frame);
  for (std::size_t i = sensing_size_; i < configuration_.stages.size(); ++i) {
    const bool is_map = configuration_.stages[i].kind == StageKind::Map;
    if (!is_map || extent != Extent::WithoutMap) runStage(i, frame);
  }
}

void Pipeline::tryAgain(Extent extent) {
  constexpr int kMostAttempts = 3;
  std::vector<LeftOut> waiting;
  for (LeftOut& left_out : left_out_) {
    Frame frame = left_out.frame;
    frame.skip_reason.clear();
    frame.again = true;
    runMapping(frame, extent);
    if (frame.skip_reason.empty()) {
      const FrameReport placed = report(frame);
      placed_again_.emplace_back(std::move(frame), placed);
    } else if (++left_out.attempts < kMostAttempts) {
      waiting.push_back(std::move(left_out));
    }
  }
  left_out_ = std::move(waiting);
}

std::vector<std::pair<Frame, FrameReport>> Pipeline::takePlacedAgain() {
  return std::exchange(placed_again_, {});
}

void Pipeline::runFrontEnd(Frame& frame) {
  const std::uint64_t pictures = pictureFingerprint(frame);
  if (pictures != 0 && pictures == last_pictures_ && frame.skip_reason.empty()) {
    frame.skip_reason =
        "the image is that of the frame before, pixel for pixel; is the camera frozen?";
  }
  if (pictures != 0) last_pictures_ = pictures;
  for (std::size_t i = 0; i < front_end_size_; ++i) runStage(i, frame);
  frame.front_end_done = true;
}

void Pipeline::runStage(std::size_t index, Frame& frame) {
  if (!frame.skip_reason.empty() || !configuration_.stages[index].enabled) return;
  const Clock::time_point start = Clock::now();
  Stage& stage = *configuration_.stages[index].stage;
  if (!adapted_[index]) {
    adapted_[index] = true;
    stage.adapt(knownScale(frame));
  }
  stage.process(frame);
  frame.stage_ms[index] = millisecondsSince(start);
}

bool Pipeline::hasStage(StageKind kind) const {
  return planar_mapping::hasStage(configuration_, kind);
}

void Pipeline::continueFrom(PlanarMap map) {
  map_ = std::move(map);
  continued_ = true;
}

void Pipeline::findUsablePoints(Frame& frame) const {
  if (!frame.skip_reason.empty()) return;
  frame.indices = usablePoints(viewOf(*frame.cloud));
  frame.points_input = frame.cloud->size();
  frame.points_valid = frame.indices.size();
  if (frame.indices.empty()) {
    frame.skip_reason = "no point of its cloud is finite; check how it was recorded";
  }
}

CloudScale Pipeline::knownScale(const Frame& frame) const {
  const PointsView points = viewOf(*frame.cloud);
  CloudScale scale = scaleOf(points, usablePoints(points), frame.T_world_sensor);
  if (frame.camera && frame.baseline) {
    scale.stereo = StereoNoise();
    scale.stereo->baseline = *frame.baseline;
    scale.stereo->focal_length = frame.camera->fx;
  }
  return scale;
}

void Pipeline::adaptMapping(const Frame& frame) {
  if (mapping_adapted_) return;
  mapping_adapted_ = true;
  CloudScale scale = knownScale(frame);
  for (std::size_t i = sensing_size_; i < configuration_.stages.size(); ++i) {
    const ConfiguredStage& configured = configuration_.stages[i];
    configured.stage->adapt(scale);
    if (configured.enabled) configured.stage->limit(scale);
    adapted_[i] = true;
  }
  if (continued_) return;
  PlanarMapParams params;
  for (const ConfiguredStage& stage : configuration_.stages) {
    if (stage.enabled) stage.stage->configureMap(params);
  }
  map_ = PlanarMap(params);
}

FrameReport Pipeline::report(const Frame& frame) const {
  FrameReport report;
  report.number = frame.number;
  report.source = frame.source;
  report.timestamp = frame.timestamp;
  report.stage_ms = frame.stage_ms;
  report.skip_reason = frame.skip_reason;
  report.statistics = frame.statistics;
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
  report.inliers = frame.inliers;
  if (hasStage(StageKind::Features)) {
    const auto was_seen = [](const KeyFeature& feature) { return feature.sightings > 1; };
    report.features = frame.key_features.size();
    report.matches = static_cast<std::size_t>(
        std::count_if(frame.key_features.begin(), frame.key_features.end(), was_seen));
  }
  report.planes = frame.planes.size();
  report.planes_new = frame.update.planes_new;
  report.planes_matched = frame.update.planes_matched;
  report.cuboids = map_.cuboidCountAtMost();
  report.map_bytes = map_.memoryBytes();
  return report;
}

}  // namespace planar_mapping
