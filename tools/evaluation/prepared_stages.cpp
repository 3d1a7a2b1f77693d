// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "prepared_stages.h"

#include <algorithm>

namespace planar_mapping::tools {
namespace {

bool isMapping(const ConfiguredStage& stage) {
  return stage.kind == StageKind::Planes || stage.kind == StageKind::Beliefs ||
         stage.kind == StageKind::Map;
}

bool isSensing(const ConfiguredStage& stage) {
  return stage.kind == StageKind::Images || stage.kind == StageKind::Features ||
         stage.kind == StageKind::Motion;
}

auto firstMapping(Configuration& configuration) {
  return std::find_if(configuration.stages.begin(), configuration.stages.end(), isMapping);
}

}  // namespace

void keepPreparingStages(Configuration& configuration) {
  configuration.stages.erase(firstMapping(configuration), configuration.stages.end());
}

void keepMappingStages(Configuration& configuration) {
  configuration.stages.erase(configuration.stages.begin(), firstMapping(configuration));
}

void dropSensingStages(Configuration& configuration) {
  auto& stages = configuration.stages;
  stages.erase(std::remove_if(stages.begin(), stages.end(), isSensing), stages.end());
}

}  // namespace planar_mapping::tools
