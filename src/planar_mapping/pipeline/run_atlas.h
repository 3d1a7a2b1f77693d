// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/run_statistics.h"
#include "planar_mapping/pipeline/runner.h"

namespace planar_mapping::detail {

/// The file of an atlas that a run makes, or goes on in. Where the run has none, nothing happens.
class RunAtlas {
 public:
  explicit RunAtlas(Pipeline& pipeline);
  /// Removes a file that is new and has no submap.
  ~RunAtlas();
  RunAtlas(const RunAtlas&) = delete;
  RunAtlas& operator=(const RunAtlas&) = delete;

  /// Before the first frame. \throws InputError; IoError of what cannot be read; OutputError
  void open(const RunOptions& options, const std::vector<std::string>& inputs);
  /// Writes the submaps that were closed, each in one transaction.
  /// \throws OutputError; they are written with the next ones then
  void storeSubmaps();
  /// After the last frame: all the rest. \return what the atlas has, a line; empty without one
  /// \throws OutputError
  std::string finish();

  /// Of the submaps of this session; empty without an atlas.
  std::vector<MapPlace> places() const;
  /// Time stamps and poses of the frames in the world of the first one, without earlier sessions.
  std::vector<std::pair<double, Pose>> trajectory() const;

 private:
  struct Store;
  Pipeline& pipeline_;
  std::unique_ptr<Store> store_;
};

}  // namespace planar_mapping::detail
