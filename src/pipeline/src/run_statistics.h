// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/pipeline/pipeline.h"
#include "standard_cells.h"

namespace planar_mapping::detail {

/// The figures of a run: frames.csv and metrics.json.
class RunStatistics {
 public:
  /// After the frame is in the map.
  void add(const FrameReport& report, const Frame& frame, const PlanarMap& map);
  /// A frame that was left out at first is in the map now.
  void addAgain(const FrameReport& report, const Frame& frame, const PlanarMap& map);
  /// Takes over the rows of an interrupted run from its files; each of its frames then
  /// has to be replayed.
  /// \throws InputError if the texts are not what framesCsv() and metricsJson() write
  void restore(const Configuration& configuration, const std::string& frames_csv,
               const std::string& metrics_json);
  /// Counts the cells of a frame that is in the map already.
  void replay(const Frame& frame, const PlanarMap& map);
  std::string framesCsv(const Configuration& configuration) const;
  std::string metricsJson(const Configuration& configuration, const PlanarMap& map,
                          std::size_t file_bytes, bool interrupted) const;
  std::size_t frames() const { return reports_.size(); }
  /// Frames that were not left out.
  std::size_t usedFrames() const;
  /// \pre a frame was left out
  const FrameReport& firstSkipped() const;

 private:
  struct Coverage {
    std::size_t points = 0;
    std::size_t covered = 0;
  };
  Coverage coverageOf(const PlanarMap& map) const;
  StandardCells& standardCells(const PlanarMap& map);
  void addPoses(const Frame& frame);
  bool posesAreGivenOnes() const;

  std::vector<FrameReport> reports_;
  std::vector<StandardCells> standard_cells_;  ///< one, once the resolution is known
  // Of the frames with an estimated and a given pose: how far is one off the other?
  std::vector<Pose> estimated_poses_;
  std::vector<Pose> given_poses_;
};

}  // namespace planar_mapping::detail
