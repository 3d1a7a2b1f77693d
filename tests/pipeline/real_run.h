// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pipeline_frames.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "real_data.h"

namespace planar_mapping {

/// What a run over frames of real data leaves behind.
struct RealRun {
  PlanarMap map;
  std::vector<Pose> estimated;  ///< of the frames that are in the map
  std::vector<Pose> given;
  std::size_t skipped = 0;
  std::string warnings;
};

/// \param inputs       of the real data, or paths
/// \param with_images  else depth alone
/// \param with_atlas   as a run that finds poses; estimated are those of the first component
inline RealRun runOver(const std::vector<std::string>& inputs, const FrameSelection& selection,
                       const std::string& configuration_file,
                       const std::vector<std::string>& assignments, bool with_images = true,
                       bool with_atlas = false) {
  Configuration configuration = test::readyConfiguration(configuration_file, assignments);
  for (const std::string& input : inputs)
    configuration.inputs.push_back(input[0] == '/' ? input : test::realData(input));
  configuration.frames = selection;
  SequenceSource frames(configuration);
  Pipeline pipeline(std::move(configuration));
  if (with_atlas) pipeline.keepAtlas(SubmapParams(), AtlasSession());
  RealRun run;
  std::map<double, Pose> given;  // by time stamp
  while (std::optional<Frame> frame = frames.next()) {
    if (!with_images) frame->images = {};
    pipeline.process(*frame);
    for (const std::string& warning : frame->warnings) run.warnings += warning + "\n";
    if (!frame->skip_reason.empty()) {
      ++run.skipped;
      continue;
    }
    run.estimated.push_back(frame->T_world_sensor);
    if (frame->given_pose) run.given.push_back(*frame->given_pose);
    if (frame->given_pose) given.emplace(frame->timestamp, *frame->given_pose);
  }
  if (with_atlas && pipeline.atlas() != nullptr) {
    pipeline.atlas()->finish();
    auto placed = pipeline.atlas()->trajectories().front().second;
    std::stable_sort(placed.begin(), placed.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    run.skipped += run.estimated.size() - placed.size();
    run.estimated.clear();
    run.given.clear();
    for (const auto& [timestamp, pose] : placed) {
      run.estimated.push_back(pose);
      if (given.count(timestamp) > 0) run.given.push_back(given.at(timestamp));
    }
  }
  run.map = pipeline.map();
  return run;
}

}  // namespace planar_mapping
