// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "evaluation/baselines/grid_cell.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/cuboid.h"
#include "planar_mapping/map/store/cell_key.h"

namespace planar_mapping::evaluation {

/// SG, the baseline every figure of merit refers to: a hash grid of cubic cells. Its number of
/// cells is A_S of the combination efficiency (the paper, IV-B).
///
/// Lean on purpose: a key and a log-odds value a cell, no free space. A cell
/// is occupied once an insertion brought it min_points points; each such insertion raises its
/// log-odds as OctoMap does (0.85 up to 3.5).
class PLANAR_MAPPING_EXPORT StandardGrid {
 public:
  /// \param s           side of a cell, metres, > 0
  /// \param min_points  that a cell needs from one insertion to be seen in it, >= 1
  /// \throws ParameterError
  explicit StandardGrid(double s, int min_points = 1);

  /// Adds the points of one frame (world frame, metres), its ground removed and cut at the range
  /// that all methods have in common. Points that are not finite or farther than 2^20 cells from
  /// the origin are left out. O(points).
  void insert(const std::vector<Vector3>& world_points);

  /// Adds one frame as OctoMap and RMAP do, and SG in the tables: the same, and cells that are
  /// there and that rays to obstacles or ground cross lose belief (0.405 a frame, OctoMap's miss);
  /// below 0.5 they are gone. Rays end in the middle of the cells the points are in, one for each;
  /// a cell that is hit is not missed. Points with too few others in their cell clear as well.
  /// \throws InputError for an origin that is not on the lattice
  void insert(const std::vector<Vector3>& obstacles, const std::vector<Vector3>& ground,
              const Vector3& origin);

  double side() const { return side_; }
  /// A_S: number of occupied cells.
  std::size_t size() const { return log_odds_.size(); }
  /// Occupied cells in ascending order, whatever the order of the points was.
  std::vector<GridCell> cells() const;
  /// The same as cubes.
  std::vector<Cuboid> cuboids() const;

  /// Bytes of a hash table of the cells, free slots included: 12 a slot, a power of two of slots of
  /// which at most three quarters are taken.
  std::size_t memoryBytes() const;
  /// Bytes of a file of the occupied cells: a header of 36 bytes (corner, numbers of cells, side,
  /// count) and each cell's number within their bounding box in as few bits as it takes.
  std::size_t fileBytes() const;

 private:
  using PointCount = planar_mapping::detail::KeyMap<std::uint32_t>;
  PointCount count(const std::vector<Vector3>& points) const;
  void hit(const PointCount& points_of_cell);

  double side_;
  std::uint32_t min_points_;
  planar_mapping::detail::KeyMap<float> log_odds_;
};

}  // namespace planar_mapping::evaluation
