// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/frame_source.h"
#include "planar_mapping/pipeline/pipeline.h"

namespace planar_mapping {

/// What a run is asked for beside its configuration.
struct RunOptions {
  std::string output;      ///< directory
  bool overwrite = false;  ///< --force
  /// Finish an interrupted run in the same directory: all frames are processed again, since stages
  /// remember earlier ones, and what is saved stays until there is as much of the map again.
  bool resume = false;
  /// Everything is saved so often while the run goes on, >= 0, or more rarely where saving takes
  /// more than a tenth of the time; 0 = after each frame. What a killed run has saved is whole.
  double checkpoint_s = 30.0;
  /// File of an atlas, which the run makes, or goes on in where it exists: the map is made of
  /// submaps, places are recognised by the images, loops are closed, and all is joined with what
  /// earlier runs left in the file. Each submap is saved when it is closed. Empty = none. With
  /// `resume` the last session of the file, if it has the same input and configuration, is the
  /// interrupted one: it stays until the run has as many frames in closed submaps, and is replaced.
  std::string atlas;
  int submap_frames = 20;                   ///< after which a submap is closed, >= 1
  const std::atomic<bool>* stop = nullptr;  ///< set by a signal: finish the frame, then save
  /// Called after each frame: frames done, frames in all (0 = not known), the frame.
  std::function<void(std::size_t, std::size_t, const FrameReport&)> progress;
  /// Called for each line of run.log as it comes about.
  std::function<void(const std::string&)> log;
};

/// What came out of a run.
struct RunResult {
  bool interrupted = false;
  bool was_finished = false;  ///< there was nothing to resume
  bool saved = true;  ///< false: interrupted before anything new was done; an earlier result stays
  std::vector<std::string> warnings;  ///< not empty: the result is degraded
  std::string metrics_json;           ///< what metrics.json says
  std::string summary;                ///< what a person wants to know of it, a few lines
  std::string output;                 ///< directory with all files
};

/// The files of a run, in the order in which they are written.
PLANAR_MAPPING_EXPORT const std::vector<std::string>& outputFileNames();

/// Does the configuration have the stages that frames of this source need?
/// \throws InputError that says which stage or which poses are missing
PLANAR_MAPPING_EXPORT void requireStagesFor(const FrameSource& source,
                                            const Configuration& configuration);

/// Input to map, with every file of docs/command_line.md left in the output directory.
/// Interrupted, or failing after some frames, it saves what was done so far. Frames that cannot be
/// used are left out with a warning; without any that can, it fails.
/// \throws ConfigError, InputError, IoError for the input, OutputError for the results
PLANAR_MAPPING_EXPORT RunResult runPipeline(Configuration configuration, const RunOptions& options);
/// The same on frames from anywhere; `inputs`, `poses` and `frames` of the configuration are only
/// reported. To resume, the source has to give the frames from the first on again.
PLANAR_MAPPING_EXPORT RunResult runPipeline(Configuration configuration, FrameSource& source,
                                            const RunOptions& options);

}  // namespace planar_mapping
