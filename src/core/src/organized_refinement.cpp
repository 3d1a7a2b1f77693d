// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "organized_refinement.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/core/parallel.h"
#include "planar_mapping/core/simd.h"

namespace planar_mapping::detail {
namespace {

/// A plane as the pixel loop wants it; squared band = max(constant, a / r^2 + b + c r^2).
struct BandedPlane {
  float normal[3];
  float offset;
  float constant, a, b, c;
  std::int16_t label;
};

// Each free pixel to the nearest of the planes within its band.
PLANAR_MAPPING_MULTIVERSION
void nearestInBand(const float* x, const float* y, const float* z, const float* sensor,
                   const BandedPlane* planes, int count, std::int16_t* labels) {
  constexpr int kLanes = 16;
  for (int k = 0; k < kTileArea; k += kLanes) {
    float best[kLanes];
    float squared_range[kLanes];
    std::int16_t label[kLanes];
    for (int lane = 0; lane < kLanes; ++lane) {
      const float rx = x[k + lane] - sensor[0];
      const float ry = y[k + lane] - sensor[1];
      const float rz = z[k + lane] - sensor[2];
      squared_range[lane] = rx * rx + ry * ry + rz * rz;
      best[lane] = labels[k + lane] < 0 ? 3e38F : -1.0F;
      label[lane] = labels[k + lane];
    }
    for (int plane = 0; plane < count; ++plane) {
      const BandedPlane& p = planes[plane];
      for (int lane = 0; lane < kLanes; ++lane) {
        const float distance = p.normal[0] * x[k + lane] + p.normal[1] * y[k + lane] +
                               p.normal[2] * z[k + lane] + p.offset;
        const float square = distance * distance;
        const float noise = p.a / squared_range[lane] + p.b + p.c * squared_range[lane];
        const float band = noise > p.constant ? noise : p.constant;
        // Comparisons with NaN are false: pixels without a point stay free.
        const bool nearer = (square <= band) & (square < best[lane]);
        best[lane] = nearer ? square : best[lane];
        label[lane] = nearer ? p.label : label[lane];
      }
    }
    for (int lane = 0; lane < kLanes; ++lane) labels[k + lane] = label[lane];
  }
}

}  // namespace

void PixelAssigner::Presence::add(std::int16_t plane) {
  for (std::int16_t& held : label) {
    if (held == plane) return;
    if (held < 0) {
      held = plane;
      return;
    }
  }
}

PixelAssigner::PixelAssigner(const TiledCloud& cloud, const CellGrid& tiles,
                             const RangeNoise& noise, const OrganizedParams& params, int threads)
    : cloud_(cloud),
      tiles_(tiles),
      noise_(noise),
      params_(params),
      threads_(threads),
      labels_(static_cast<std::size_t>(cloud.tiles()) * kTileArea, -1),
      presence_(static_cast<std::size_t>(cloud.tiles())) {}

int PixelAssigner::freePixels(int tile) const {
  const std::int16_t* labels = labels_.data() + static_cast<std::size_t>(tile) * kTileArea;
  int labelled = 0;
  for (int i = 0; i < kTileArea; ++i) labelled += labels[i] >= 0;
  return static_cast<int>(tiles_.count(tile)) - labelled;
}

void PixelAssigner::addCells(const CellGrid& grid, const std::vector<std::int16_t>& cell_labels) {
  const int cells_per_side = grid.columns / cloud_.columns;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const std::int16_t label = cell_labels[static_cast<std::size_t>(row) * grid.columns + column];
      if (label < 0) continue;
      const int tile = (row / cells_per_side) * cloud_.columns + column / cells_per_side;
      presence_[static_cast<std::size_t>(tile)].add(label);
    }
  }
}

void PixelAssigner::clearLabels() {
  std::fill(labels_.begin(), labels_.end(), std::int16_t{-1});
}

void PixelAssigner::assignTile(int tile, const std::vector<PlaneCandidate>& planes,
                               const std::vector<Presence>& before) {
  constexpr int kMostCandidates = 12;
  const int row = tile / cloud_.columns;
  const int column = tile % cloud_.columns;
  std::int16_t candidates[kMostCandidates];
  int count = 0;
  for (int r = std::max(0, row - 1); r <= std::min(cloud_.rows - 1, row + 1); ++r) {
    for (int c = std::max(0, column - 1); c <= std::min(cloud_.columns - 1, column + 1); ++c) {
      const Presence& held = before[static_cast<std::size_t>(r) * cloud_.columns + c];
      for (const std::int16_t label : held.label) {
        if (label < 0) break;
        if (std::find(candidates, candidates + count, label) == candidates + count &&
            count < kMostCandidates) {
          candidates[count++] = label;
        }
      }
    }
  }
  if (count == 0) return;
  BandedPlane banded[kMostCandidates];
  for (int i = 0; i < count; ++i) {
    const PlaneCandidate& plane = planes[static_cast<std::size_t>(candidates[i])];
    BandedPlane& b = banded[i];
    for (int axis = 0; axis < 3; ++axis) b.normal[axis] = static_cast<float>(plane.normal[axis]);
    b.offset = static_cast<float>(plane.offset);
    // On the plane the noise along the ray counts by the cosine |sensor distance| / r.
    const double factor = params_.noise_factor * plane.distance(cloud_.sensor.data());
    const double squared_factor = factor * factor;
    b.constant = static_cast<float>(params_.distance_threshold * params_.distance_threshold);
    b.a = static_cast<float>(squared_factor * noise_.constant * noise_.constant);
    b.b = static_cast<float>(squared_factor * 2.0 * noise_.constant * noise_.quadratic);
    b.c = static_cast<float>(squared_factor * noise_.quadratic * noise_.quadratic);
    b.label = candidates[i];
  }
  const float sensor[3] = {static_cast<float>(cloud_.sensor.x()),
                           static_cast<float>(cloud_.sensor.y()),
                           static_cast<float>(cloud_.sensor.z())};
  nearestInBand(cloud_.x(tile), cloud_.y(tile), cloud_.z(tile), sensor, banded, count,
                labels_.data() + static_cast<std::size_t>(tile) * kTileArea);
}

void PixelAssigner::assign(const std::vector<PlaneCandidate>& planes) {
  constexpr int kMinPresent = kTileArea / 4;
  const std::vector<Presence> before = presence_;
  parallelFor(static_cast<std::size_t>(cloud_.rows), threads_, [&](std::size_t row) {
    for (int column = 0; column < cloud_.columns; ++column) {
      const int tile = static_cast<int>(row) * cloud_.columns + column;
      if (tiles_.count(tile) > 0.0) assignTile(tile, planes, before);
    }
  });
  std::vector<int> counts(planes.size(), 0);
  for (int tile = 0; tile < cloud_.tiles(); ++tile) {
    const std::int16_t* labels = labels_.data() + static_cast<std::size_t>(tile) * kTileArea;
    for (int i = 0; i < kTileArea; ++i) {
      if (labels[i] >= 0 && ++counts[static_cast<std::size_t>(labels[i])] == kMinPresent) {
        presence_[static_cast<std::size_t>(tile)].add(labels[i]);
      }
    }
    for (int i = 0; i < kTileArea; ++i) {
      if (labels[i] >= 0) counts[static_cast<std::size_t>(labels[i])] = 0;
    }
  }
}

void PixelAssigner::refit(std::vector<PlaneCandidate>& planes) const {
  for (PlaneCandidate& plane : planes) plane.sums = {};
  MomentSums sums;
  for (int tile = 0; tile < cloud_.tiles(); ++tile) {
    const double finite = tiles_.count(tile);
    if (finite < 1.0) continue;
    const std::int16_t* labels = labels_.data() + static_cast<std::size_t>(tile) * kTileArea;
    std::int16_t seen[kTileArea];
    int distinct = 0;
    int labelled = 0;
    for (int i = 0; i < kTileArea; ++i) {
      if (labels[i] < 0) continue;
      ++labelled;
      if (distinct > 0 && seen[distinct - 1] == labels[i]) continue;
      if (std::find(seen, seen + distinct, labels[i]) == seen + distinct) {
        seen[distinct++] = labels[i];
      }
    }
    if (distinct == 1 && labelled == static_cast<int>(finite)) {
      addSums(planes[static_cast<std::size_t>(seen[0])].sums, tiles_, tile);
      continue;
    }
    for (int k = 0; k < distinct; ++k) {
      sumLabelledPixels(cloud_, tile, labels, seen[k], sums.data());
      addSums(planes[static_cast<std::size_t>(seen[k])].sums, sums);
    }
  }
  for (PlaneCandidate& plane : planes) plane.fit();
}

void PixelAssigner::relabel(const std::vector<std::int16_t>& target) {
  for (std::int16_t& label : labels_) {
    if (label >= 0) label = target[static_cast<std::size_t>(label)];
  }
  for (Presence& held : presence_) {
    Presence renamed;
    for (const std::int16_t label : held.label) {
      if (label >= 0 && target[static_cast<std::size_t>(label)] >= 0) {
        renamed.add(target[static_cast<std::size_t>(label)]);
      }
    }
    held = renamed;
  }
}

}  // namespace planar_mapping::detail
