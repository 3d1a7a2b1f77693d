// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/run_statistics.h"
#include "planar_mapping/pipeline/runner.h"

namespace planar_mapping::detail {

/// The atlas that a run makes, or goes on in. Where the run has none, nothing happens.
class RunAtlas {
 public:
  explicit RunAtlas(Pipeline& pipeline);
  ~RunAtlas();
  RunAtlas(const RunAtlas&) = delete;
  RunAtlas& operator=(const RunAtlas&) = delete;

  /// Whether a run of these inputs began a session of the file and did not close it.
  bool wasInterrupted(const std::string& path, const std::vector<std::string>& inputs) const;
  /// Before the first frame; the file is made with the first submap that is closed.
  /// \param path    of the file
  /// \param is_own  of a run that finds poses and is given no other: that of an earlier run is
  ///                replaced
  /// \throws InputError; IoError of what cannot be read; OutputError
  void open(const std::string& path, bool is_own, const RunOptions& options,
            const std::vector<std::string>& inputs);
  /// Writes the submaps that were closed, each in one transaction.
  /// \throws OutputError; they are written with the next ones then
  void storeSubmaps();
  /// After the last frame: all the rest. \return what the atlas has, a line; empty without one
  /// \throws OutputError
  std::string finish();
  /// What finish() wrote is safe, and so is all else that the run made.
  /// \throws OutputError
  void close();

  /// Of the submaps of this session; empty without an atlas.
  std::vector<MapPlace> places() const;
  using Trajectory = std::vector<std::pair<double, Pose>>;  ///< time stamps, T_world_sensor
  /// By component, without earlier sessions; that of the first frame first.
  std::vector<std::pair<std::int64_t, Trajectory>> trajectories() const;

 private:
  struct Store;
  Pipeline& pipeline_;
  std::unique_ptr<Store> store_;
};

}  // namespace planar_mapping::detail
