// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/organized/organized_steps.h"

#include <algorithm>
#include <utility>

#include "planar_mapping/planes/tiles/plane_fit.h"

namespace planar_mapping::detail {
namespace {

/// The planes of quarters: what has grown over their free pixels, else what others of them have.
std::vector<std::int16_t> labelsOfQuarters(const CellGrid& quarters,
                                           const std::vector<std::int16_t>& grown,
                                           const PixelLabels& pixels) {
  std::vector<std::int16_t> labels = grown;
  std::size_t cell = 0;
  for (int row = 0; row < quarters.rows; ++row) {
    for (int column = 0; column < quarters.columns; ++column, ++cell) {
      const int tile = row / 2 * (quarters.columns / 2) + column / 2;
      if (labels[cell] >= 0 || !pixels.holdsPlane(tile)) continue;
      labels[cell] = pixels.wholePlane(tile);
      if (labels[cell] >= 0) continue;
      const std::int16_t* own = pixels.labelsOf(tile) + ((row % 2) * 2 + column % 2) * kQuarterArea;
      const auto held =
          std::find_if(own, own + kQuarterArea, [](std::int16_t of) { return of >= 0; });
      if (held != own + kQuarterArea) labels[cell] = *held;
    }
  }
  return labels;
}

}  // namespace

std::vector<std::int16_t> growPlanes(CellGrower& grower, const CellGrid& grid, const PlaneFit& fit,
                                     int min_inliers, std::vector<PlaneCandidate>& planes,
                                     PixelLabels& pixels, PlaneSearchDiagnostics& diagnostics) {
  GrownCells grown = grower.grow(kMinSeedFraction * min_inliers, planes);
  diagnostics.hypotheses += grown.seeds;
  diagnostics.rejected_too_small += grown.too_small;
  const std::vector<std::int16_t> target =
      grid.capacity == kTileArea
          ? mergeCandidates(planes, grown.labels, grid.columns, grid.rows, fit)
          : mergeCandidates(planes, labelsOfQuarters(grid, grown.labels, pixels), grid.columns,
                            grid.rows, fit);
  pixels.relabel(target);
  for (std::int16_t& label : grown.labels) {
    if (label >= 0) label = target[static_cast<std::size_t>(label)];
  }
  return std::move(grown.labels);
}

void refit(std::vector<PlaneCandidate>& planes, const std::vector<TilePart>& parts,
           const PlaneFit& fit) {
  const std::vector<PartList> lists = partsOfPlanes(parts, planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    planes[i].sums = {};
    for (const std::size_t part : lists[i]) addSums(planes[i].sums, parts[part].sums);
    fit.fit(planes[i]);
    fit.refine(planes[i], parts, lists[i]);
  }
}

void reject(std::vector<PlaneCandidate>& planes, PixelLabels& pixels, double min_points,
            const TiledCloud& cloud, const PlaneFit& fit, bool test_coherence,
            PlaneSearchDiagnostics& diagnostics) {
  const std::vector<TilePart>& parts = pixels.parts();
  refit(planes, parts, fit);
  const std::vector<char> coherent =
      test_coherence ? coherentPlanes(planes, parts, cloud.columns, cloud.tiles(), fit)
                     : std::vector<char>(planes.size(), 1);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (!(planes[i].sums[kN] > 0.0)) {
      planes[i].valid = false;
    } else if (!planes[i].valid || planes[i].sums[kN] < min_points) {
      ++diagnostics.rejected_too_small;
      planes[i].valid = false;
    } else if (!coherent[i]) {
      ++diagnostics.rejected_not_coherent;
      planes[i].valid = false;
    }
  }
  freeInvalid(planes, pixels);
}

void freeInvalid(const std::vector<PlaneCandidate>& planes, PixelLabels& pixels) {
  std::vector<std::int16_t> target(planes.size(), -1);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (planes[i].valid) target[i] = static_cast<std::int16_t>(i);
  }
  pixels.relabel(target);
}

std::vector<PlaneSegment*> makeSegments(const PointsView& points, const TiledCloud& cloud,
                                        PixelLabels& pixels, double patch_gap,
                                        std::vector<PlaneCandidate>& planes, PlaneSet& set) {
  const std::vector<TilePart>& parts = pixels.parts();
  for (PlaneCandidate& plane : planes) plane.sums = {};
  for (const TilePart& part : parts) {
    addSums(planes[static_cast<std::size_t>(part.label)].sums, part.sums);
  }
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (planes[i].valid) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return planes[a].sums[kN] > planes[b].sums[kN];
  });
  set.planes.resize(order.size());
  std::vector<PlaneSegment*> segments(planes.size(), nullptr);
  for (std::size_t i = 0; i < order.size(); ++i) segments[order[i]] = &set.planes[i];
  listSegments(points, cloud, pixels.labels(), parts, patch_gap, segments);
  return segments;
}

}  // namespace planar_mapping::detail
