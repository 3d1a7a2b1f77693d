// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/organized/organized_assignment.h"

#include <algorithm>

#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr float kFar = 3e38F;

/// A plane as the pixel loop wants it; squared band = max(constant, a / r^2 + b + c r^2).
struct BandedPlane {
  float normal[3];
  float offset;
  float constant, a, b, c;
  float least;  ///< added to the squared noise when planes compete, square metres
  std::int16_t label;
};

// Each free pixel to the nearest of the planes within its band.
PLANAR_MAPPING_MULTIVERSION
void nearestInBand(const float* x, const float* sensor, const BandedPlane* planes, int count,
                   std::int16_t* labels) {
  const FloatLanes zero = {};
  for (int k = 0; k < kTileArea; k += kLanes) {
    FloatLanes px, py, pz;
    IntLanes label;
    load(x + k, px, py, pz);
    load(labels + k, label);
    const FloatLanes rx = px - sensor[0];
    const FloatLanes ry = py - sensor[1];
    const FloatLanes rz = pz - sensor[2];
    const FloatLanes squared_range = rx * rx + ry * ry + rz * rz;
    const FloatLanes inverse = 1.0F / squared_range;
    FloatLanes best = label < 0 ? zero + kFar : zero - 1.0F;
    for (int plane = 0; plane < count; ++plane) {
      const BandedPlane& p = planes[plane];
      const FloatLanes distance = p.normal[0] * px + p.normal[1] * py + p.normal[2] * pz + p.offset;
      const FloatLanes square = distance * distance;
      const FloatLanes noise = p.a * inverse + p.b + p.c * squared_range;
      const FloatLanes constant = zero + p.constant;
      const FloatLanes band = noise > constant ? noise : constant;
      // In units of the noise across each plane: rays that graze a plane leave it fast.
      // Comparisons with NaN are false: pixels without a point stay free.
      const FloatLanes score = square <= band ? square / (noise + p.least) : zero + kFar;
      label = score < best ? IntLanes{} + p.label : label;
      best = score < best ? score : best;
    }
    store(label, labels + k);
  }
}

}  // namespace

void PixelAssigner::reopen(const CellGrid& grid, const std::vector<std::int16_t>& cell_labels) {
  const int cells_per_side = grid.columns / cloud_.columns;
  std::vector<char> open(static_cast<std::size_t>(cloud_.tiles()), 0);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      if (cell_labels[static_cast<std::size_t>(row) * grid.columns + column] < 0) continue;
      const int r0 = row / cells_per_side;
      const int c0 = column / cells_per_side;
      for (int r = std::max(0, r0 - 1); r <= std::min(cloud_.rows - 1, r0 + 1); ++r) {
        for (int c = std::max(0, c0 - 1); c <= std::min(cloud_.columns - 1, c0 + 1); ++c) {
          open[static_cast<std::size_t>(r) * cloud_.columns + c] = 1;
        }
      }
    }
  }
  for (std::size_t tile = 0; tile < open.size(); ++tile) {
    if (!open[tile]) continue;
    std::fill_n(labels_.begin() + static_cast<std::ptrdiff_t>(tile * kTileArea), kTileArea,
                std::int16_t{-1});
    summarize(static_cast<int>(tile));
    changed_[tile] = 1;
  }
}

void PixelAssigner::free(int tile, int quarter, std::int16_t label) {
  std::int16_t* labels =
      labels_.data() + static_cast<std::size_t>(tile) * kTileArea + quarter * kQuarterArea;
  for (int i = 0; i < kQuarterArea; ++i) labels[i] = labels[i] == label ? -1 : labels[i];
  changed_[static_cast<std::size_t>(tile)] = 1;
}

void PixelAssigner::recount() {
  for (int tile = 0; tile < cloud_.tiles(); ++tile) {
    if (changed_[static_cast<std::size_t>(tile)]) summarize(tile);
  }
}

bool PixelAssigner::changedAround(int tile) const {
  const int row = tile / cloud_.columns;
  const int column = tile % cloud_.columns;
  for (int r = std::max(0, row - 1); r <= std::min(cloud_.rows - 1, row + 1); ++r) {
    for (int c = std::max(0, column - 1); c <= std::min(cloud_.columns - 1, column + 1); ++c) {
      if (changed_[static_cast<std::size_t>(r) * cloud_.columns + c]) return true;
    }
  }
  return false;
}

void PixelAssigner::assignTile(int tile, const std::vector<PlaneCandidate>& planes, int reach) {
  std::int16_t candidates[kMaxAround];
  const int count = planesAround(tile, reach, candidates);
  if (count == 0) return;
  const OrganizedParams& params = fit_.params();
  const RangeNoise& noise = fit_.noise();
  const double border = isNoisy(tile) ? params.growingDistance() : params.touchingDistance();
  BandedPlane banded[kMaxAround];
  for (int i = 0; i < count; ++i) {
    const PlaneCandidate& plane = planes[static_cast<std::size_t>(candidates[i])];
    BandedPlane& b = banded[i];
    for (int axis = 0; axis < 3; ++axis) b.normal[axis] = static_cast<float>(plane.normal[axis]);
    b.offset = static_cast<float>(plane.offset);
    // On the plane the noise along the ray counts by the cosine |sensor distance| / r.
    const double factor = params.noise_factor * plane.height;
    const double squared_factor = factor * factor;
    const bool inside = reach == 0 || grown_[static_cast<std::size_t>(tile)].holds(candidates[i]);
    const double band = inside ? params.distance_threshold : border;
    b.constant = static_cast<float>(band * band);
    b.a = static_cast<float>(squared_factor * noise.constant * noise.constant);
    b.b = static_cast<float>(squared_factor * 2.0 * noise.constant * noise.quadratic);
    b.c = static_cast<float>(squared_factor * noise.quadratic * noise.quadratic);
    const double least =
        params.noise_factor * params.competing_fraction * params.distance_threshold;
    b.least = static_cast<float>(least * least);
    b.label = candidates[i];
  }
  const float sensor[3] = {static_cast<float>(cloud_.sensor.x()),
                           static_cast<float>(cloud_.sensor.y()),
                           static_cast<float>(cloud_.sensor.z())};
  nearestInBand(cloud_.x(tile), sensor, banded, count, labelsOf(tile));
  summarize(tile);
}

void PixelAssigner::assign(const std::vector<PlaneCandidate>& planes) {
  parallelFor(static_cast<std::size_t>(cloud_.rows), threads_, [&](std::size_t row) {
    for (int column = 0; column < cloud_.columns; ++column) {
      const int tile = static_cast<int>(row) * cloud_.columns + column;
      if (summaries_[static_cast<std::size_t>(tile)].free > 0 && changedAround(tile)) {
        assignTile(tile, planes, 1);
      }
    }
  });
  updatePresence(kTileArea / 4, false);
}

void PixelAssigner::fill(const std::vector<PlaneCandidate>& planes) {
  parallelFor(static_cast<std::size_t>(cloud_.rows), threads_, [&](std::size_t row) {
    for (int column = 0; column < cloud_.columns; ++column) {
      const int tile = static_cast<int>(row) * cloud_.columns + column;
      if (summaries_[static_cast<std::size_t>(tile)].free > 0) assignTile(tile, planes, 0);
    }
  });
}

}  // namespace planar_mapping::detail
