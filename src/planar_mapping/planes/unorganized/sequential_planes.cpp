// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "planar_mapping/planes/plane_search.h"
#include "planar_mapping/planes/point_cells.h"
#include "planar_mapping/planes/surface_leaves.h"
#include "planar_mapping/planes/unorganized/cell_assignment.h"
#include "planar_mapping/planes/unorganized/leaf_planes.h"

namespace planar_mapping::detail {

namespace {

// Cells are at least this many thresholds wide.
constexpr double kCellSideInThresholds = 3.0;
// Fraction of the points that must not be alone in the cells used, and for a cloud to be dense.
constexpr double kAccompaniedFraction = 0.5;
constexpr double kAccompaniedFractionIfDense = 0.75;
// A cell is turned like a plane within this angle, radians, and so many standard deviations of its
// normal; this fraction of the points along the plane must be in such cells.
constexpr double kSameTurn = 0.35;
constexpr double kSureOfNormal = 2.0;
constexpr double kMinAgreement = 0.65;
// Points in such cells are more than those beside the plane, by this fraction of all on it: the
// flat crests of cloth agree with a plane, the rest of the cloth crosses it.
constexpr double kMinLead = 0.2;

/// Of the points in the flat cells along a plane.
struct Agreement {
  double all = 0.0;
  double agreeing = 0.0;  ///< their cell is turned like the plane
};

/// All but the edges of a surface agree with a plane, only some of a cut through clutter.
bool isSurface(const Agreement& agreement, const PlaneEvidence& evidence) {
  const double beside = evidence.above + evidence.below;
  return agreement.all > 0.0 && agreement.agreeing >= kMinAgreement * agreement.all &&
         agreement.agreeing - beside >= kMinLead * evidence.sums.n;
}

std::vector<Agreement> agreementWith(const std::vector<Plane>& planes, const PointCells& grid,
                                     const SurfaceLeaves& surface,
                                     const CellCandidates& candidates) {
  std::vector<Agreement> agreement(planes.size());
  for (const LeafInCell& entry : surface.leaves_in_cells) {
    const SurfaceLeaf& leaf = surface.leaves[static_cast<std::size_t>(entry.leaf)];
    if (!leaf.planar) continue;
    const auto cell = static_cast<std::size_t>(entry.cell);
    const double weight = grid.sums[cell].n;
    const double angle = std::min(kSameTurn + kSureOfNormal * leaf.normal_deviation, M_PI_2);
    const double cosine = std::cos(angle);
    for (const std::int32_t candidate : candidates[cell]) {
      if (candidate < 0) break;
      const auto k = static_cast<std::size_t>(candidate);
      if (std::abs(planes[k].signedDistance(leaf.mean)) > leaf.band) continue;
      agreement[k].all += weight;
      if (std::abs(leaf.normal.dot(planes[k].normal)) >= cosine) agreement[k].agreeing += weight;
    }
  }
  return agreement;
}

/// Whether the points on the plane stand out from those beside it. The fuller side counts twice: at
/// the edge of a cloud of clutter there is nothing on the other.
bool isSignificant(const PlaneEvidence& evidence, double significance) {
  const double on = evidence.sums.n;
  const double beside = 2.0 * std::max(evidence.above, evidence.below);
  return on - beside >= significance * std::sqrt(on + beside);
}

/// Takes no points.
Plane noPlane() {
  return {Vector3::Zero(), std::numeric_limits<double>::infinity()};
}

}  // namespace

bool isDense(const PointsView& points, const Indices* indices, const MultiPlaneParams& params) {
  const double smallest = kCellSideInThresholds * params.distance_threshold;
  return chooseCellSide(points, indices, smallest, kAccompaniedFractionIfDense) <= smallest;
}

PlaneSet findPlanesSequential(const PointsView& points, const Indices* indices,
                              const MultiPlaneParams& params, const Vector3& sensor) {
  PlaneSearchDiagnostics diagnostics;
  const DistanceBand band(params);
  const double side = chooseCellSide(
      points, indices, kCellSideInThresholds * params.distance_threshold, kAccompaniedFraction);
  PointCells grid = buildPointCells(points, indices, side);
  diagnostics.points_not_measured = grid.points_not_measured;
  SurfaceLeaves surface = buildSurfaceLeaves(grid, band, sensor);
  splitFaces(points, indices, grid, sensor, surface);
  const std::vector<LeafPlane> found = findLeafPlanes(surface, params, diagnostics);

  std::vector<Plane> planes;
  Vector3 origin = Vector3::Zero();
  for (const LeafPlane& plane : found) planes.push_back(plane.plane);
  if (!found.empty()) {
    origin = surface.leaves[static_cast<std::size_t>(found[0].support[0])].mean;
  }
  CellCandidates candidates = candidatesOfCells(grid, surface, found, band);
  const std::vector<PlaneEvidence> evidence =
      gatherEvidence(points, indices, grid, candidates, planes, origin, params);
  std::vector<char> good(planes.size(), 0);
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const PlaneMoments::Fit fit = evidence[k].sums.moments(origin).fit();
    const bool significant = isSignificant(evidence[k], params.significance);
    if (!significant) ++diagnostics.rejected_not_significant;
    good[k] = fit.valid && significant ? 1 : 0;
    if (fit.valid) planes[k] = fit.plane;
  }
  const std::vector<Agreement> agreement = agreementWith(planes, grid, surface, candidates);
  for (std::size_t k = 0; k < planes.size(); ++k) {
    if (good[k] != 0 && isSurface(agreement[k], evidence[k])) continue;
    if (good[k] != 0) ++diagnostics.rejected_not_coherent;
    planes[k] = noPlane();
  }
  // Far rings are no evidence: a plane too small without them stays so. A stereo camera has none.
  std::vector<Plane> large = planes;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    if (evidence[k].sums.n < params.min_inliers) large[k] = noPlane();
  }
  if (!params.noise) addFarRings(grid, large, band, sensor, candidates);
  const std::vector<std::int32_t> labels =
      labelPoints(points, indices, grid, candidates, planes, params);
  grid = PointCells();  // as large as the labels, and no longer needed
  PlaneSet set =
      assemblePlaneSet(points, labels, planes, params, sensor, InlierRule::WithinThreshold);
  diagnostics.rejected_too_small += set.diagnostics.rejected_too_small;
  set.diagnostics = diagnostics;
  return set;
}

}  // namespace planar_mapping::detail
