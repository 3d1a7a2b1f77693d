// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <numeric>

#include "planes/organized/organized_agreement.h"
#include "planes/organized/organized_folds.h"
#include "planes/organized/organized_refinement.h"
#include "planes/organized/organized_segments.h"
#include "planes/plane_search.h"

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

/// Sums and planes from the parts they hold.
void refit(std::vector<PlaneCandidate>& planes, const std::vector<TilePart>& parts,
           const TiledCloud& cloud, const RangeNoise& noise, const OrganizedParams& params) {
  std::vector<std::vector<std::size_t>> lists(planes.size());
  for (PlaneCandidate& plane : planes) plane.sums = {};
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const auto label = static_cast<std::size_t>(parts[part].label);
    addSums(planes[label].sums, parts[part].sums);
    lists[label].push_back(part);
  }
  for (std::size_t i = 0; i < planes.size(); ++i) {
    planes[i].fit(cloud.sensor);
    fitAlongRays(planes[i], parts, lists[i], noise, cloud.sensor, params);
  }
}

/// Grown tiles as parts of planes.
std::vector<TilePart> wholeTiles(const CellGrid& tiles, const std::vector<std::int16_t>& labels) {
  std::vector<TilePart> parts;
  parts.reserve(labels.size());
  for (int tile = 0; tile < tiles.cells(); ++tile) {
    const std::int16_t label = labels[static_cast<std::size_t>(tile)];
    if (label < 0) continue;
    parts.push_back({tile, label, static_cast<std::int16_t>(tiles.count(tile)), {}});
    addSums(parts.back().sums, tiles, tile);
  }
  return parts;
}

/// Where noise blurs the edges between planes, pixels and planes settle together.
void settleEdges(std::vector<PlaneCandidate>& planes, PixelAssigner& pixels,
                 const TiledCloud& cloud, const RangeNoise& noise, const OrganizedParams& params,
                 int rounds) {
  if (!pixels.isNoisy()) return;
  for (int round = 0; round < rounds; ++round) {
    refit(planes, pixels.parts(), cloud, noise, params);
    pixels.settleEdges(planes);
  }
}

/// Refits planes to their pixels and frees those of planes that are too small or none.
void drop(std::vector<PlaneCandidate>& planes, PixelAssigner& pixels, double min_points,
          const TiledCloud& cloud, const RangeNoise& noise, const OrganizedParams& params,
          PlaneSearchDiagnostics& diagnostics) {
  const std::vector<TilePart>& parts = pixels.parts();
  refit(planes, parts, cloud, noise, params);
  const std::vector<char> coherent =
      coherentPlanes(planes, parts, cloud.columns, cloud.tiles(), noise, cloud.sensor, params);
  std::vector<std::int16_t> target(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    target[i] = static_cast<std::int16_t>(i);
    if (!(planes[i].sums[kN] > 0.0)) {
      planes[i].valid = false;
    } else if (!planes[i].valid || planes[i].sums[kN] < min_points) {
      ++diagnostics.rejected_too_small;
      planes[i].valid = false;
    } else if (!coherent[i]) {
      ++diagnostics.rejected_not_coherent;
      planes[i].valid = false;
    }
    if (!planes[i].valid) target[i] = -1;
  }
  pixels.relabel(target);
}

/// Frees the pixels of planes that too few agree with.
void dropSmall(std::vector<PlaneCandidate>& planes, PixelAssigner& pixels, int min_inliers,
               PlaneSearchDiagnostics& diagnostics) {
  const std::vector<std::int64_t> counts = pixels.counts(planes.size());
  std::vector<std::int16_t> target(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    target[i] = static_cast<std::int16_t>(i);
    if (planes[i].valid && counts[i] < min_inliers) {
      ++diagnostics.rejected_not_coherent;
      planes[i].valid = false;
    }
    if (!planes[i].valid) target[i] = -1;
  }
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

/// The planes of quarters: what has grown over their free pixels, else what others of them have.
CellLabels labelsOfQuarters(const CellGrid& quarters, const std::vector<std::int16_t>& grown,
                            const PixelAssigner& pixels) {
  CellLabels cells{quarters.columns, quarters.rows, grown};
  for (int row = 0; row < cells.rows; ++row) {
    for (int column = 0; column < cells.columns; ++column) {
      std::int16_t& label = cells.labels[static_cast<std::size_t>(row) * cells.columns + column];
      const int tile = row / 2 * (cells.columns / 2) + column / 2;
      if (label >= 0 || !pixels.holdsPlane(tile)) continue;
      const std::int16_t* own = pixels.labelsOf(tile) + ((row % 2) * 2 + column % 2) * kQuarterArea;
      const auto held =
          std::find_if(own, own + kQuarterArea, [](std::int16_t of) { return of >= 0; });
      if (held != own + kQuarterArea) label = *held;
    }
  }
  return cells;
}

void count(const GrownCells& grown, PlaneSearchDiagnostics& diagnostics) {
  diagnostics.hypotheses += grown.seeds;
  diagnostics.rejected_too_small += grown.too_small;
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

  RangeNoise noise;
  std::vector<PlaneCandidate> planes;
  GrownCells grown;
  {
    CellGrower grower(tiles, true, cloud.room[1], cloud.sensor, own);
    grower.estimateNoise();
    noise = grower.noise();
    if (params.noise) {
      noise.constant = 0.0;
      noise.quadratic = params.noise->depthError(1.0);
      grower.setNoise(noise);
    }
    grown = grower.grow(planes);
    count(grown, set.diagnostics);
  }
  std::vector<std::int16_t> target =
      mergeCandidates(planes, {tiles.columns, tiles.rows, grown.labels}, noise, cloud.sensor, own);
  PixelAssigner pixels(cloud, tiles, noise, own, params.threads);
  std::vector<std::int16_t> tile_labels = renamed(grown.labels, target);
  cutFolds(tiles, noise, cloud.sensor, own, planes, tile_labels);
  refit(planes, wholeTiles(tiles, tile_labels), cloud, noise, own);
  pixels.addCells(tiles, tile_labels);
  for (int round = 0; round < own.assignment_rounds; ++round) pixels.assign(planes);
  settleEdges(planes, pixels, cloud, noise, own, own.settling_rounds);
  drop(planes, pixels, params.min_inliers * own.min_seed_share, cloud, noise, own, set.diagnostics);
  {
    const CellGrid quarters = freeQuarterGrid(cloud, pixels.labels(), params.threads);
    CellGrower grower(quarters, false, cloud.room[1], cloud.sensor, own);
    grower.setNoise(noise);
    grown = grower.grow(planes);
    count(grown, set.diagnostics);
    target = mergeCandidates(planes, labelsOfQuarters(quarters, grown.labels, pixels), noise,
                             cloud.sensor, own);
    pixels.relabel(target);
    pixels.addCells(quarters, renamed(grown.labels, target));
    pixels.reopen(quarters, grown.labels);
  }
  for (int round = 0; round < own.assignment_rounds; ++round) pixels.assign(planes);
  settleEdges(planes, pixels, cloud, noise, own, 1);
  drop(planes, pixels, params.min_inliers, cloud, noise, own, set.diagnostics);
  // The planes stand; what else lies within d_T of them where they are counts as theirs (Eq. 11).
  pixels.fill(planes);
  freeDisagreeing(cloud, planes, noise, own, params.threads, pixels);
  dropSmall(planes, pixels, params.min_inliers, set.diagnostics);
  for (PlaneCandidate& plane : planes) plane.sums = {};
  const std::vector<TilePart>& parts = pixels.parts();
  for (const TilePart& part : parts) {
    addSums(planes[static_cast<std::size_t>(part.label)].sums, part.sums);
  }
  writeSegments(points, cloud, planes, pixels, parts, params, sensor, set);
  return set;
}

}  // namespace planar_mapping::detail
