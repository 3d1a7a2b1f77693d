// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

/// \param inputs  of the real data, or paths
inline RealRun runOver(const std::vector<std::string>& inputs, const FrameSelection& selection,
                       const std::string& configuration_file,
                       const std::vector<std::string>& assignments) {
  Configuration configuration = test::readyConfiguration(configuration_file, assignments);
  for (const std::string& input : inputs)
    configuration.inputs.push_back(input[0] == '/' ? input : test::realData(input));
  configuration.frames = selection;
  SequenceSource frames(configuration);
  Pipeline pipeline(std::move(configuration));
  RealRun run;
  while (std::optional<Frame> frame = frames.next()) {
    pipeline.process(*frame);
    for (const std::string& warning : frame->warnings) run.warnings += warning + "\n";
    if (!frame->skip_reason.empty()) {
      ++run.skipped;
      continue;
    }
    run.estimated.push_back(frame->T_world_sensor);
    if (frame->given_pose) run.given.push_back(*frame->given_pose);
  }
  run.map = pipeline.map();
  return run;
}

}  // namespace planar_mapping
