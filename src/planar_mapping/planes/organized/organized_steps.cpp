// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/organized/organized_steps.h"

#include <algorithm>
#include <utility>

#include "planar_mapping/base/parallel.h"
#include "planar_mapping/planes/tiles/plane_fit.h"

namespace planar_mapping::detail {

std::vector<std::int16_t> growPlanes(CellGrower& grower, const CellGrid& grid, const PlaneFit& fit,
                                     int min_inliers, std::vector<PlaneCandidate>& planes,
                                     PixelLabels& pixels, PlaneSearchDiagnostics& diagnostics) {
  GrownCells grown = grower.grow(kMinSeedFraction * min_inliers, planes);
  diagnostics.hypotheses += grown.seeds;
  diagnostics.rejected_too_small += grown.too_small;
  pixels.addCells(grid, grown.labels);
  const std::vector<std::int16_t> target =
      mergeCandidates(planes, pixels.adjacentPlanes(planes.size()), fit);
  pixels.relabel(target);
  for (std::int16_t& label : grown.labels) {
    if (label >= 0) label = target[static_cast<std::size_t>(label)];
  }
  return std::move(grown.labels);
}

void refit(std::vector<PlaneCandidate>& planes, const std::vector<TilePart>& parts,
           const PlaneFit& fit, int threads) {
  const std::vector<PartList> lists = partsOfPlanes(parts, planes.size());
  parallelFor(planes.size(), threads, [&](std::size_t i) {
    planes[i].sums = {};
    for (const std::size_t part : lists[i]) addSums(planes[i].sums, parts[part].sums);
    fit.fit(planes[i]);
    fit.refine(planes[i], parts, lists[i]);
  });
}

void reject(std::vector<PlaneCandidate>& planes, PixelLabels& pixels, double min_points,
            const TiledCloud& cloud, const PlaneFit& fit, bool test_coherence,
            PlaneSearchDiagnostics& diagnostics) {
  const std::vector<TilePart>& parts = pixels.parts();
  refit(planes, parts, fit, pixels.threads());
  const std::vector<char> coherent =
      test_coherence ? coherentPlanes(planes, parts, cloud.columns, fit, pixels.threads())
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
                                        PixelLabels& pixels, const MultiPlaneParams& params,
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
  listSegments(points, cloud, pixels.labels(), parts, params.patch_gap, params.threads, segments);
  return segments;
}

}  // namespace planar_mapping::detail
