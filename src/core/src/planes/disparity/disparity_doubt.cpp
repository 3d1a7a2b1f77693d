// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/disparity/disparity_fit.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "planes/tiles/plane_fit.h"

namespace planar_mapping::detail {
namespace {

/// Whether the errors of pixels cancel within tiles, as those of matching do and the relief of a
/// rough surface does not.
bool areTilesSmoother(const PlaneCandidate& plane, const std::vector<TilePart>& parts,
                      const PartList& list, const DisparityParams& params) {
  double squares = 0.0;
  for (const std::size_t i : list) {
    const double error = plane.meanError(parts[i].sums);
    squares += parts[i].sums[kN] * error * error;
  }
  const double most = params.noise_tile_fraction * plane.residual;
  return squares <= plane.sums[kN] * most * most;
}

/// Points of no plane beside a part, in the quarters of the tile that it is in: off the plane by
/// one to three widths of its band.
double countBeside(const PlaneCandidate& plane, const TilePart& part, const TiledCloud& cloud,
                   const std::int16_t* labels, const DisparityParams& params) {
  constexpr double kReach = 3.0;  // widths of the band
  const float* x = cloud.x(part.tile);
  const float* y = cloud.y(part.tile);
  const float* d = cloud.z(part.tile);
  const double least = params.tolerance(params.noise_factor);
  double beside = 0.0;
  for (int quarter = 0; quarter < kTileArea; quarter += kQuarterArea) {
    const std::int16_t* first = labels + quarter;
    if (std::find(first, first + kQuarterArea, part.label) == first + kQuarterArea) continue;
    for (int k = quarter; k < quarter + kQuarterArea; ++k) {
      if (labels[k] >= 0) continue;
      const double band =
          std::max(least, DisparityFit::toPixels(plane, params.distance_threshold, d[k]));
      // False for a hole.
      if (std::fabs(d[k] - (plane.normal[0] * x[k] + plane.normal[1] * y[k] + plane.offset)) <=
          kReach * band) {
        beside += 1.0;
      }
    }
  }
  return beside;
}

/// Points in the largest set of blocks of tiles that touch each other: windows of one facade lie
/// in one set, twigs on either side of the image do not.
double countTogether(const std::vector<TilePart>& parts, const PartList& list, int columns) {
  constexpr int kBlock = 8;  // tiles
  const int blocks = (columns + kBlock - 1) / kBlock;
  std::map<int, double> counts;  // that no set holds yet
  for (const std::size_t i : list) {
    const int tile = parts[i].tile;
    counts[tile / columns / kBlock * blocks + tile % columns / kBlock] += parts[i].sums[kN];
  }
  double most = 0.0;
  std::vector<int> reached;
  while (!counts.empty()) {
    double together = counts.begin()->second;
    reached.assign(1, counts.begin()->first);
    counts.erase(counts.begin());
    for (std::size_t head = 0; head < reached.size(); ++head) {
      const int block = reached[head];
      for (int step = 0; step < 9; ++step) {
        const int column = block % blocks + step % 3 - 1;
        if (column < 0 || column >= blocks) continue;
        const auto next = counts.find((block / blocks + step / 3 - 1) * blocks + column);
        if (next == counts.end()) continue;
        together += next->second;
        reached.push_back(next->first);
        counts.erase(next);
      }
    }
    most = std::max(most, together);
  }
  return most;
}

}  // namespace

bool isNoiseOfPlane(const PlaneCandidate& plane, const std::vector<TilePart>& parts,
                    const PartList& list, const TiledCloud& cloud,
                    const std::vector<std::int16_t>& labels, const DisparityParams& params) {
  if (list.size() < static_cast<std::size_t>(params.least_noisy_tiles)) return false;
  if (plane.residual > params.most_noisy_residual * params.noise) return false;
  if (!areTilesSmoother(plane, parts, list, params)) return false;
  if (bendOf(plane, parts, list, {Vector3::UnitX(), Vector3::UnitY()}).advantage >
      params.bent_advantage)
    return false;
  // A direction in doubt says nothing about what lies farther on.
  if (countTogether(parts, list, cloud.columns) < params.least_together * plane.sums[kN]) {
    return false;
  }
  double beside = 0.0;
  for (const std::size_t i : list) {
    const auto* tile = labels.data() + static_cast<std::size_t>(parts[i].tile) * kTileArea;
    beside += countBeside(plane, parts[i], cloud, tile, params);
  }
  return beside <= params.most_beside * plane.sums[kN];
}

}  // namespace planar_mapping::detail
