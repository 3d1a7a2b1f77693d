// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_runs.h"

#include <chrono>
#include <memory>
#include <utility>

#include "planar_mapping/pipeline/pipeline.h"

namespace planar_mapping::tools {
namespace {

/// Stands where the preparing stages stood and gives back what they, and the stages for planes of
/// an earlier run, have left.
class PreparedStage : public Stage {
 public:
  /// \param replaced the preparing stages, for what they say of every cloud
  explicit PreparedStage(std::vector<ConfiguredStage> replaced) : replaced_(std::move(replaced)) {}
  void declare(ParameterTable&) override {}
  void adapt(const CloudScale& scale) override {
    for (ConfiguredStage& stage : replaced_) stage.stage->adapt(scale);
  }
  void limit(CloudScale& scale) const override {
    for (const ConfiguredStage& stage : replaced_) stage.stage->limit(scale);
  }
  void process(Frame& frame) override {
    frame.indices = prepared_->frame.indices;
    frame.ground = prepared_->frame.ground;
    if (planes_ != nullptr) frame.planes = *planes_;
  }
  void set(const PreparedFrame* prepared, const std::vector<PlaneSegment>* planes) {
    prepared_ = prepared;
    planes_ = planes;
  }

 private:
  std::vector<ConfiguredStage> replaced_;
  const PreparedFrame* prepared_ = nullptr;
  const std::vector<PlaneSegment>* planes_ = nullptr;
};

std::string planeStagesText(const Configuration& configuration) {
  std::string text = std::to_string(static_cast<int>(configuration.settings.profile)) + " " +
                     std::to_string(configuration.settings.seed);
  for (const ConfiguredStage& stage : configuration.stages) {
    if (stage.kind != StageKind::Planes || !stage.enabled) continue;
    text += "\n" + stage.name;
    for (const Parameter& parameter : stage.parameters.parameters()) {
      text += " " + parameter.name + "=" + toYaml(parameter.get());
    }
  }
  return text;
}

/// The stages that remove points and are enabled; empty ones are left in their place.
std::vector<ConfiguredStage> takePointStages(Configuration& configuration) {
  std::vector<ConfiguredStage> taken;
  for (ConfiguredStage& stage : configuration.stages) {
    if (stage.kind == StageKind::Points && stage.enabled) taken.push_back(std::move(stage));
  }
  return taken;
}

void disablePlaneStages(Configuration& configuration) {
  for (ConfiguredStage& stage : configuration.stages) {
    if (stage.kind == StageKind::Planes) stage.enabled = false;
  }
}

}  // namespace

int minPointsPerCell(const Configuration& configuration) {
  PlanarMapParams params;
  for (const ConfiguredStage& stage : configuration.stages) {
    if (stage.enabled) stage.stage->configureMap(params);
  }
  return params.approximation.min_points_per_cell;
}

PlanarRun PlanarRuns::make(Configuration configuration) {
  std::vector<ConfiguredStage> preparing = takePointStages(configuration);
  keepMappingStages(configuration);
  const std::string text = planeStagesText(configuration);
  const auto known = planes_.find(text);
  const Planes* earlier = known == planes_.end() ? nullptr : &known->second;
  if (earlier != nullptr) disablePlaneStages(configuration);
  ConfiguredStage first;
  first.name = "prepared";
  first.kind = StageKind::Points;
  auto stage = std::make_unique<PreparedStage>(std::move(preparing));
  PreparedStage& prepared = *stage;
  first.stage = std::move(stage);
  configuration.stages.insert(configuration.stages.begin(), std::move(first));

  Pipeline pipeline(std::move(configuration));
  PlanarRun run;
  Planes found;
  for (std::size_t i = 0; i < place_.frames.size(); ++i) {
    prepared.set(&place_.frames[i], earlier != nullptr ? &earlier->of_frames[i] : nullptr);
    Frame frame = place_.frames[i].frame;
    const FrameReport report = pipeline.process(frame);
    run.time_ms += report.frame_ms - frame.stage_ms.front();
    const auto& stages = pipeline.configuration().stages;
    for (std::size_t k = 1; k < stages.size(); ++k) {
      if (stages[k].kind == StageKind::Planes) found.time_ms += frame.stage_ms[k];
    }
    if (earlier == nullptr) found.of_frames.push_back(std::move(frame.planes));
  }
  run.map = pipeline.map();
  const auto start = std::chrono::steady_clock::now();
  run.map.cuboids();
  const std::chrono::duration<double, std::milli> listing =
      std::chrono::steady_clock::now() - start;
  run.time_ms += listing.count();
  if (earlier != nullptr) {
    run.time_ms += earlier->time_ms;
  } else {
    planes_.emplace(text, std::move(found));
  }
  return run;
}

}  // namespace planar_mapping::tools
