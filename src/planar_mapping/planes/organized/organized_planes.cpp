// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numeric>

#include "planar_mapping/base/point_indices.h"
#include "planar_mapping/planes/organized/metric_fit.h"
#include "planar_mapping/planes/organized/organized_assignment.h"
#include "planar_mapping/planes/organized/organized_steps.h"
#include "planar_mapping/planes/plane_search.h"

namespace planar_mapping::detail {
namespace {

constexpr int kAssignmentRounds = 2;  ///< rings of tiles around grown cells that are looked at

/// Grown tiles as parts of planes.
std::vector<TilePart> wholeTiles(const CellGrid& tiles, const std::vector<std::int16_t>& labels) {
  std::vector<TilePart> parts;
  parts.reserve(labels.size());
  for (int tile = 0; tile < tiles.cells(); ++tile) {
    const std::int16_t label = labels[static_cast<std::size_t>(tile)];
    if (label < 0) continue;
    parts.push_back({tile, label, static_cast<std::int16_t>(tiles.count(tile)), {}});
    parts.back().sums = sumsOf(tiles, tile);
  }
  return parts;
}

/// Where noise blurs the edges between planes, pixels and planes settle together.
void settleEdges(std::vector<PlaneCandidate>& planes, PixelAssigner& pixels, const MetricFit& fit,
                 int rounds) {
  if (!pixels.isNoisy()) return;
  for (int round = 0; round < rounds; ++round) {
    refit(planes, pixels.parts(), fit);
    pixels.settleEdges(planes);
  }
}

/// Frees the pixels of planes that too few agree with.
void dropSmall(std::vector<PlaneCandidate>& planes, PixelAssigner& pixels, int min_inliers,
               PlaneSearchDiagnostics& diagnostics) {
  const std::vector<std::int64_t> counts = pixels.counts(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (!planes[i].valid || counts[i] >= min_inliers) continue;
    ++diagnostics.rejected_not_coherent;
    planes[i].valid = false;
  }
  freeInvalid(planes, pixels);
}

void describe(const PlaneCandidate& plane, const TiledCloud& cloud, const Vector3& sensor,
              PlaneSegment& segment) {
  const MomentSums& sums = plane.sums;
  Matrix3 outer;
  outer << sums[kXX], sums[kXY], sums[kXZ], sums[kXY], sums[kYY], sums[kYZ], sums[kXZ], sums[kYZ],
      sums[kZZ];
  segment.moments =
      PlaneMoments::fromSums(sums[kN], {sums[kX], sums[kY], sums[kZ]}, outer, cloud.origin);
  segment.plane =
      orientedTowards({plane.normal, plane.offset - plane.normal.dot(cloud.origin)}, sensor);
  segment.rms = std::sqrt(plane.meanSquare(sums));
  segment.tilt = normalizedTilt(segment.plane);
  segment.covariance = segment.moments.planeCovariance(segment.moments.fit());
}

}  // namespace

PlaneSet findPlanesOrganized(const PointsView& points, const Indices* indices,
                             const MultiPlaneParams& params, const Vector3& sensor) {
  PlaneSet set;
  const TiledCloud cloud = tileCloud(points, indices, sensor, nullptr, params.threads);
  const CellGrid tiles = tileGrid(cloud, params.threads);
  const double finite = std::accumulate(tiles.moment(kN), tiles.moment(kN) + tiles.cells(), 0.0);
  set.diagnostics.points_not_measured = countOf(points, indices) - static_cast<std::size_t>(finite);
  if (!(finite > 0.0)) return set;

  const OrganizedParams own(params);
  MetricFit fit(own, cloud.sensor);
  MetricGrower grower(tiles, true, fit);
  RangeNoise noise = grower.noise();
  if (params.noise) {
    noise.constant = 0.0;
    noise.quadratic = params.noise->depthError(1.0);
  }
  fit.setNoise(noise);
  std::vector<PlaneCandidate> planes;
  PixelAssigner pixels(cloud, tiles, fit, params.threads);
  std::vector<std::int16_t> labels =
      growPlanes(grower, tiles, fit, params.min_inliers, planes, pixels, set.diagnostics);
  refit(planes, wholeTiles(tiles, labels), fit);
  pixels.addCells(tiles, labels);
  for (int round = 0; round < kAssignmentRounds; ++round) pixels.assign(planes);
  settleEdges(planes, pixels, fit, own.settling_rounds);
  reject(planes, pixels, params.min_inliers * kMinSeedFraction, cloud, fit, true, set.diagnostics);
  {
    const CellGrid quarters = freeQuarterGrid(cloud, pixels.labels(), params.threads);
    MetricGrower of_quarters(quarters, false, fit);
    labels =
        growPlanes(of_quarters, quarters, fit, params.min_inliers, planes, pixels, set.diagnostics);
    pixels.addCells(quarters, labels);
    pixels.reopen(quarters, labels);
  }
  for (int round = 0; round < kAssignmentRounds; ++round) pixels.assign(planes);
  settleEdges(planes, pixels, fit, 1);
  reject(planes, pixels, params.min_inliers, cloud, fit, true, set.diagnostics);
  // The planes are final; what else lies within d_T of them where they are counts as theirs (Eq.
  // 11).
  pixels.fill(planes);
  freeDisagreeing(cloud, planes, fit, params.threads, pixels);
  dropSmall(planes, pixels, params.min_inliers, set.diagnostics);
  const std::vector<PlaneSegment*> segments =
      makeSegments(points, cloud, pixels, params.patch_gap, planes, set);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (segments[i] != nullptr) describe(planes[i], cloud, sensor, *segments[i]);
  }
  return set;
}

}  // namespace planar_mapping::detail
