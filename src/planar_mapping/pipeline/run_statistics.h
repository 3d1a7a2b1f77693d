// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/map/store/cell_key.h"
#include "planar_mapping/pipeline/pipeline.h"

namespace planar_mapping::detail {

/// The cells of a standard grid that points fell into: A_S of the combination efficiency, and for
/// each cell one of its points.
class StandardCells {
 public:
  struct Cell {
    std::size_t points = 0;
    float point[3] = {0.0f, 0.0f, 0.0f};  ///< one of them: the last that made their number 2^n
  };

  explicit StandardCells(double resolution) : resolution_(resolution) {}
  /// World frame, metres. What is beyond the grid, as it is beyond any map, is left out.
  void add(const Vector3& point);
  std::size_t size() const { return cells_.size(); }
  /// Points in or within half a cell of a cuboid, and all points. A point of each cell stands for
  /// all that fell into it.
  std::pair<std::size_t, std::size_t> coveredBy(const PlanarMap& map) const;

 private:
  double resolution_;
  KeyMap<Cell> cells_;
};

/// The figures of a run: frames.csv and metrics.json.
class RunStatistics {
 public:
  /// After the frame is in the map, or was left out.
  void add(const FrameReport& report, const Frame& frame, const PlanarMap& map);
  /// A frame that was left out at first is in the map now: its row is replaced.
  void addAgain(FrameReport report, const Frame& frame, const PlanarMap& map);
  std::string framesCsv(const Configuration& configuration) const;
  nlohmann::ordered_json metrics(const Configuration& configuration, const PlanarMap& map) const;
  const std::vector<FrameReport>& reports() const { return reports_; }
  std::size_t frames() const { return reports_.size(); }
  /// Frames that were not left out.
  std::size_t usedFrames() const { return used_; }

 private:
  void count(const Frame& frame, const PlanarMap& map);

  std::vector<FrameReport> reports_;
  std::size_t used_ = 0;
  std::optional<StandardCells> standard_cells_;  ///< once the resolution is known
  std::vector<Pose> estimated_poses_;  ///< of the frames that have an estimated and a given pose
  std::vector<Pose> given_poses_;
  bool has_true_poses_ = false;  ///< a given pose was not only assumed, and not taken as it is
};

/// The names of the stages; one that occurs twice gets a number, so that no key stands for two.
std::vector<std::string> stageKeys(const Configuration& configuration);

}  // namespace planar_mapping::detail
