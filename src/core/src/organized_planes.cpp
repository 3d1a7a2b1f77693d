// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <numeric>

#include "organized_refinement.h"
#include "organized_segments.h"
#include "plane_search.h"

namespace planar_mapping::detail {
namespace {

OrganizedParams organizedParams(const MultiPlaneParams& params) {
  OrganizedParams own;
  own.distance_threshold = params.distance_threshold;
  own.max_normal_deviation = params.max_normal_deviation;
  own.noise_factor = params.noise_factor;
  own.min_inliers = params.min_inliers;
  return own;
}

/// Frees the pixels of planes that are too small and closes the gaps in their numbering.
void dropSmall(std::vector<PlaneCandidate>& planes, PixelAssigner& pixels, double min_points,
               std::size_t& dropped) {
  std::vector<std::int16_t> target(planes.size(), -1);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (!planes[i].valid || planes[i].sums[kN] < min_points) {
      ++dropped;
      continue;
    }
    target[i] = static_cast<std::int16_t>(kept);
    planes[kept++] = planes[i];
  }
  if (kept == planes.size()) return;
  planes.resize(kept);
  pixels.relabel(target);
}

std::vector<std::int16_t> renamed(const std::vector<std::int16_t>& labels,
                                  const std::vector<std::int16_t>& target) {
  std::vector<std::int16_t> result(labels.size(), -1);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] >= 0) result[i] = target[static_cast<std::size_t>(labels[i])];
  }
  return result;
}

}  // namespace

PlaneSet findPlanesOrganized(const PointsView& points, const Indices* indices,
                             const MultiPlaneParams& params, const Vector3& sensor) {
  PlaneSet set;
  set.diagnostics.method = PlaneSearchMethod::Organized;
  set.diagnostics.points_considered = indices ? indices->size() : points.size;
  const TiledCloud cloud = tileCloud(points, indices, sensor, params.threads);
  if (cloud.tiles() == 0) {
    set.diagnostics.points_not_finite = set.diagnostics.points_considered;
    return set;
  }
  const OrganizedParams own = organizedParams(params);
  const CellGrid tiles = tileGrid(cloud, params.threads);
  const double finite = std::accumulate(tiles.moment(kN), tiles.moment(kN) + tiles.cells(), 0.0);
  set.diagnostics.points_not_finite =
      set.diagnostics.points_considered - static_cast<std::size_t>(finite);

  CellGrower grower(tiles, cloud.sensor, own);
  RangeNoise noise;
  if (params.noise) {
    noise.quadratic = params.noise->depthError(1.0);
    grower.setNoise(noise);
  } else {
    grower.estimateNoise();
    noise = grower.noise();
  }
  std::vector<PlaneCandidate> planes;
  PixelAssigner pixels(cloud, tiles, noise, own, params.threads);
  const GrownCells coarse = grower.grow(planes);
  const std::vector<std::int16_t> coarse_target = mergeCandidates(planes, noise, cloud.sensor, own);
  pixels.addCells(tiles, renamed(coarse.labels, coarse_target));
  pixels.assign(planes);
  pixels.refit(planes);
  pixels.clearLabels();
  for (int round = 0; round < own.assignment_rounds; ++round) pixels.assign(planes);
  pixels.refit(planes);
  dropSmall(planes, pixels, params.min_inliers * own.min_seed_share,
            set.diagnostics.rejected_too_small);

  if (own.fine_pass) {
    const CellGrid quarters = freeQuarterGrid(cloud, pixels.labels(), params.threads);
    CellGrower fine(quarters, cloud.sensor, own);
    fine.setNoise(noise);
    const GrownCells grown = fine.grow(planes);
    const std::vector<std::int16_t> target = mergeCandidates(planes, noise, cloud.sensor, own);
    pixels.relabel(target);
    pixels.addCells(quarters, renamed(grown.labels, target));
    for (int round = 0; round < own.assignment_rounds; ++round) pixels.assign(planes);
    pixels.refit(planes);
    set.diagnostics.hypotheses += grown.seeds;
    set.diagnostics.rejected_too_small += grown.too_small;
  }
  dropSmall(planes, pixels, params.min_inliers, set.diagnostics.rejected_too_small);
  set.diagnostics.hypotheses += coarse.seeds;
  set.diagnostics.rejected_too_small += coarse.too_small;
  writeSegments(points, cloud, planes, pixels, params, sensor, set);
  return set;
}

}  // namespace planar_mapping::detail
