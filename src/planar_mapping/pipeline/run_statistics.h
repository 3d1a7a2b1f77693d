// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/map/store/cell_key.h"
#include "planar_mapping/pipeline/pipeline.h"

namespace planar_mapping::detail {

/// Unknown space of more cells than these is not listed in map.json, which would have hundreds of
/// megabytes; one of 4 million cells has some 20.
constexpr std::size_t kMostUnknownInJson = std::size_t{1} << 22;

/// What was saved, for the log: numbers, and what the files lack.
std::string savedText(const PlanarMap& map, std::size_t file_bytes);

/// The cells of a standard grid that points fell into: A_S of the combination efficiency, and for
/// each cell one of its points.
class StandardCells {
 public:
  struct Cell {
    std::size_t points = 0;
    float point[3] = {0.0f, 0.0f, 0.0f};  ///< one of them: the last that made their number 2^n
  };

  explicit StandardCells(double resolution = 1.0) : resolution_(resolution) {}
  /// World frame, metres. What is beyond the grid, as it is beyond any map, is left out.
  void add(const Vector3& point) {
    std::uint64_t key = 0;
    if (!detail::cellKeyOf(point, resolution_, key)) return;
    Cell& cell = cells_[key];
    ++cell.points;
    if ((cell.points & (cell.points - 1)) != 0) return;
    for (int axis = 0; axis < 3; ++axis) cell.point[axis] = static_cast<float>(point[axis]);
  }
  std::size_t size() const { return cells_.size(); }
  /// Occupied cells; neighbours along x come one after the other.
  template <typename Visitor>
  void forEach(const Visitor& visit) const {
    for (const std::uint64_t key : cells_.sortedKeys()) visit(*cells_.find(key));
  }
  template <typename Archive>
  void visitState(Archive& archive) {
    std::uint64_t count = cells_.size();
    archive(resolution_, count);
    for (std::uint64_t i = 0; i < count; ++i) {
      std::uint64_t key = Archive::kReads ? 0 : cells_.key(i);
      Cell cell = Archive::kReads ? Cell() : cells_.value(i);
      archive(key, cell);
      if (Archive::kReads) cells_[key] = cell;
    }
  }

 private:
  double resolution_;
  KeyMap<Cell> cells_;
};

/// The figures of a run: frames.csv and metrics.json.
class RunStatistics {
 public:
  /// After the frame is in the map.
  void add(const FrameReport& report, const Frame& frame, const PlanarMap& map);
  /// A frame that was left out at first is in the map now.
  void addAgain(const FrameReport& report, const Frame& frame, const PlanarMap& map);
  std::string framesCsv(const Configuration& configuration) const;
  std::string metricsJson(const Configuration& configuration, const PlanarMap& map,
                          std::size_t file_bytes, bool interrupted) const;
  std::size_t frames() const { return reports_.size(); }
  /// Frames that were not left out.
  std::size_t usedFrames() const;
  std::size_t pointsBeyond() const;
  /// Of the finite points, those that stages removed or merged before planes were looked for.
  double removedFraction() const;
  /// Whether ground was removed from more than half of the frames that were used.
  bool hasGroundInMostFrames() const;
  /// Whether features come of images that nobody knows to be registered to the depth.
  bool mayBeUnregistered() const;
  /// \pre a frame was left out
  const FrameReport& firstSkipped() const;
  /// The frames at the end that were read and left out, all of them.
  std::vector<FrameReport> skippedEnd() const;
  /// Whether a frame was left out that had been read.
  bool hasSkippedPoints() const;
  /// For a run that is continued by another process.
  template <typename Archive>
  void visitState(Archive& archive);

 private:
  void count(const Frame& frame, const PlanarMap& map);
  /// Over the frames that were not left out.
  std::size_t sum(std::size_t FrameReport::*field) const;
  struct Coverage {
    std::size_t points = 0;
    std::size_t covered = 0;
  };
  Coverage coverageOf(const PlanarMap& map) const;
  bool posesAreGivenOnes() const;

  std::vector<FrameReport> reports_;
  std::vector<StandardCells> standard_cells_;  ///< one, once the resolution is known
  // Of the frames with an estimated and a given pose: how far is one off the other?
  std::vector<Pose> estimated_poses_;
  std::vector<Pose> given_poses_;
  bool all_assumed_ = true;  ///< Frame::pose_assumed of all those
};

template <typename Archive>
void RunStatistics::visitState(Archive& archive) {
  std::size_t count = reports_.size();
  archive(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (Archive::kReads) reports_.emplace_back();  // one by one: the count may be damaged
    FrameReport& r = reports_[i];
    std::size_t statistics = r.statistics.size();
    archive(r.number, r.source, r.timestamp, r.read_ms, r.stage_ms, r.frame_ms, r.skip_reason,
            r.points_input, r.points_valid, r.points_ground, r.points_planar, r.points_non_planar,
            r.points_rejected, r.features, r.matches, r.inliers, r.planes, r.planes_new,
            r.planes_matched, r.cuboids, r.map_bytes, r.points_beyond, statistics);
    for (std::size_t k = 0; k < statistics; ++k) {
      if (Archive::kReads) r.statistics.emplace_back();
      archive(r.statistics[k].name, r.statistics[k].value);
    }
  }
  archive(standard_cells_, estimated_poses_, given_poses_, all_assumed_);
}

}  // namespace planar_mapping::detail
