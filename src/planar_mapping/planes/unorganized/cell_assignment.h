// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "planar_mapping/planes/point_cells.h"
#include "planar_mapping/planes/unorganized/leaf_planes.h"

namespace planar_mapping::detail {

/// Up to so many planes meet in a cell; -1 fills the rest.
constexpr std::size_t kPlanesPerCell = 6;
using CellCandidates = std::vector<std::array<std::int32_t, kPlanesPerCell>>;

/// Adds a plane to a cell, unless it is there or the cell is full.
void addCandidate(std::array<std::int32_t, kPlanesPerCell>& cell, std::int32_t plane);

/// The plane each leaf voted for, -1 for none.
std::vector<std::int32_t> planesOfLeaves(const SurfaceLeaves& surface,
                                         const std::vector<LeafPlane>& planes);

/// The planes each cell of the grid may hold points of: those its leaf or a neighbour's voted for
/// and that pass through it.
CellCandidates candidatesOfCells(const PointCells& grid, const SurfaceLeaves& surface,
                                 const std::vector<LeafPlane>& planes, const DistanceBand& band);

/// What the points say about each plane.
struct PlaneEvidence {
  PointSums sums;  ///< of the points on it, about the origin given
  /// Points one to two thresholds above and below it that no other plane is nearer to.
  double above = 0.0;
  double below = 0.0;
};

/// Evidence from all points, each given to the nearest of the candidates of its cell.
std::vector<PlaneEvidence> gatherEvidence(const PointsView& points, const Indices* indices,
                                          const PointCells& grid, const CellCandidates& candidates,
                                          const std::vector<Plane>& planes, const Vector3& origin,
                                          const MultiPlaneParams& params);

/// Labels every point of the cloud with the nearest candidate of its cell within the threshold.
/// Planes with a zero normal take no points.
std::vector<std::int32_t> labelPoints(const PointsView& points, const Indices* indices,
                                      const PointCells& grid, const CellCandidates& candidates,
                                      const std::vector<Plane>& planes,
                                      const MultiPlaneParams& params);

/// Makes planes candidates of the cells beyond their leaves that hold a piece of a scanner's ring
/// on them: a line in the plane that the sensor sees next to what is on the plane already, with
/// nothing between, ring by ring. Where rings are far apart they make no leaves.
/// \param planes those with a zero normal take no cells
void addFarRings(const PointCells& grid, const std::vector<Plane>& planes, const DistanceBand& band,
                 const Vector3& sensor, CellCandidates& candidates);

}  // namespace planar_mapping::detail
