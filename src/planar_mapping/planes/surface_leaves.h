// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/planes/plane_search.h"
#include "planar_mapping/planes/point_cells.h"

namespace planar_mapping::detail {

/// A piece of cloud just large enough for a normal: a cell, or where that is too sparse, narrow or
/// thin against the noise, the pooled poor cells of one of 2, 4 or 8 times the side. Both
/// faces of a wall in one cube have a leaf each, twins.
struct SurfaceLeaf {
  CellKey key;             ///< at its level
  int level = 0;           ///< the side is that of the grid times 2^level
  std::int32_t twin = -1;  ///< the leaf of the other face, or -1
  bool planar = false;
  bool thick = false;  ///< as thick as two faces of a wall
  PointSums sums;      ///< about the centre of the leaf
  Vector3 mean = Vector3::Zero();
  Vector3 normal = Vector3::Zero();
  double normal_deviation = 0.0;  ///< one standard deviation of the normal, radians
  double band = 0.0;              ///< d_T(z) at the mean
};

constexpr int kLeafLevels = 4;

/// A leaf and a cell of the grid that some of its points are in.
struct LeafInCell {
  std::int32_t cell = -1;
  std::int32_t leaf = -1;
};

struct SurfaceLeaves {
  std::vector<SurfaceLeaf> leaves;
  double side = 0.0;                          ///< of a leaf of level 0
  std::array<CellTable, kLeafLevels> tables;  ///< leaves of each level by key ...
  std::array<Indices, kLeafLevels> names;     ///< ... and their place in leaves
  std::vector<LeafInCell> leaves_in_cells;    ///< by cell; a cell of the grid may have several

  double sideOf(const SurfaceLeaf& leaf) const { return side * (1 << leaf.level); }
  Vector3 centreOf(const SurfaceLeaf& leaf) const {
    return Vector3(leaf.key.x + 0.5, leaf.key.y + 0.5, leaf.key.z + 0.5) * sideOf(leaf);
  }
  /// The leaf of that level and key, or -1.
  std::int32_t find(int level, const CellKey& key) const {
    const auto l = static_cast<std::size_t>(level);
    const std::int32_t place = tables[l].find(key);
    return place < 0 ? -1 : names[l][static_cast<std::size_t>(place)];
  }
  /// Of a leaf and its twin the one nearer to the plane.
  std::int32_t nearerTwin(std::int32_t leaf, const Plane& plane) const {
    const auto distance = [&](std::int32_t i) {
      return std::abs(plane.signedDistance(leaves[static_cast<std::size_t>(i)].mean));
    };
    const std::int32_t twin = leaves[static_cast<std::size_t>(leaf)].twin;
    return twin >= 0 && distance(twin) < distance(leaf) ? twin : leaf;
  }
};

/// Smallest eigenvector of the scatter of \p sums and the eigenvalues, ascending.
struct LocalFit {
  Vector3 mean = Vector3::Zero();    ///< about the same point as the sums
  Vector3 normal = Vector3::Zero();  ///< zero where the points are on a line
  Vector3 eigenvalues = Vector3::Zero();
};
LocalFit fitLocally(const PointSums& sums);

/// Whether a fit of the points of a cube of \p side is a surface rather than a blob or a line.
bool isSurface(const LocalFit& fit, double side, double band);

SurfaceLeaves buildSurfaceLeaves(const PointCells& grid, const DistanceBand& band,
                                 const Vector3& sensor);

/// Makes twins of the leaves that hold both faces of a wall.
void splitFaces(const PointsView& points, const Indices* indices, const PointCells& grid,
                const Vector3& sensor, SurfaceLeaves& surface);

}  // namespace planar_mapping::detail
