// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
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
  /// Points of other cells, from their world to this one: of each cell they go where one of them
  /// goes.
  void add(const StandardCells& other, const Pose& T_this_other);
  std::size_t size() const { return cells_.size(); }
  double resolution() const { return resolution_; }
  /// Points in or within half a cell of a cuboid, and all points. A point of each cell stands for
  /// all that fell into it.
  std::pair<std::size_t, std::size_t> coveredBy(const PlanarMap& map) const;

 private:
  double resolution_;
  KeyMap<Cell> cells_;
};

/// Where one of the maps that frames were added to lies in the map of all.
struct MapPlace {
  const PlanarMap* map = nullptr;
  std::int64_t submap = 0;
  std::int64_t component = 0;  ///< maps of one component have one world
  Pose T_world_map = Pose::Identity();
};

/// The figures of a run: frames.csv and metrics.json.
class RunStatistics {
 public:
  /// After the frame is in the map, or was left out.
  void add(const FrameReport& report, const Frame& frame, const PlanarMap& map);
  /// \param places  of the submaps, the first that of the world; empty = there is one map
  std::string framesCsv(const Configuration& configuration,
                        const std::vector<MapPlace>& places) const;
  nlohmann::ordered_json metrics(const Configuration& configuration, const PlanarMap& map,
                                 const std::vector<MapPlace>& places) const;
  const std::vector<FrameReport>& reports() const { return reports_; }
  std::size_t frames() const { return reports_.size(); }
  /// Frames that were not left out.
  std::size_t usedFrames() const { return used_; }

 private:
  void count(const Frame& frame, const PlanarMap& map);

  /// A frame's points in the cells of the map that it was added to.
  struct Part {
    const PlanarMap* map;
    StandardCells cells;
  };
  StandardCells& cellsFor(const PlanarMap& map);
  /// Of the frames in the world.
  StandardCells joinedCells(const std::vector<MapPlace>& places) const;
  nlohmann::ordered_json motionError(const std::vector<MapPlace>& places) const;

  std::vector<FrameReport> reports_;
  std::vector<const PlanarMap*> maps_;  ///< that they were added to; null where they were not
  std::size_t used_ = 0;
  std::vector<Part> parts_;
  /// A frame that has an estimated and a given pose.
  struct Estimate {
    const PlanarMap* map;  ///< that it was added to
    Pose T_map_sensor;
    Pose given;
  };
  std::vector<Estimate> estimates_;
  bool has_true_poses_ = false;  ///< a given pose was not only assumed, and not taken as it is
};

/// The names of the stages; one that occurs twice gets a number, so that no key stands for two.
std::vector<std::string> stageKeys(const Configuration& configuration);

}  // namespace planar_mapping::detail
