// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/organized/organized_refinement.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/organized_lanes.h"
#include "planar_mapping/core/base/detail/parallel.h"
#include "planar_mapping/core/base/detail/simd.h"

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
void nearestInBand(const float* x, const float* y, const float* z, const float* sensor,
                   const BandedPlane* planes, int count, std::int16_t* labels) {
  const FloatLanes zero = {};
  for (int k = 0; k < kTileArea; k += kLanes) {
    FloatLanes px, py, pz;
    IntLanes label;
    load(x + k, px);
    load(y + k, py);
    load(z + k, pz);
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

// Lists the labels of a tile by first occurrence with the number of pixels each has. Where there
// are more than `most`, the pixels of the others stay free.
PLANAR_MAPPING_MULTIVERSION
int countLabels(std::int16_t* labels, std::int16_t* list, std::int16_t* counts, int most) {
  constexpr int kVectors = kTileArea / kShortLanes;
  const ShortLanes lane = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  const ShortLanes none = ShortLanes{} - 1;
  const ShortLanes past = ShortLanes{} + kTileArea;
  ShortLanes rest[kVectors];
  std::memcpy(rest, labels, sizeof(rest));
  for (int size = 0;; ++size) {
    ShortLanes first = past;
    for (int v = 0; v < kVectors; ++v) {
      const ShortLanes place =
          rest[v] >= 0 ? lane + static_cast<std::int16_t>(v * kShortLanes) : past;
      first = place < first ? place : first;
    }
    const int next = smallestOf(first);
    if (next == kTileArea) return size;
    if (size == most) {
      for (int k = 0; k < kTileArea; ++k)
        labels[k] = rest[k / kShortLanes][k % kShortLanes] >= 0 ? -1 : labels[k];
      return size;
    }
    const ShortLanes label = ShortLanes{} + labels[next];
    ShortLanes held = {};
    for (int v = 0; v < kVectors; ++v) {
      const ShortLanes same = rest[v] == label;
      held -= same;
      rest[v] = same ? none : rest[v];
    }
    list[size] = labels[next];
    counts[size] = sumOf(held);
  }
}

}  // namespace

bool PlaneList::holds(std::int16_t plane) const {
  for (int k = 0; k < size; ++k) {
    if (label[k] == plane) return true;
  }
  return false;
}

void PlaneList::add(std::int16_t plane) {
  if (size < kMost && !holds(plane)) label[size++] = plane;
}

bool PlaneList::isRenamed(const std::vector<std::int16_t>& target) const {
  for (int k = 0; k < size; ++k) {
    if (target[static_cast<std::size_t>(label[k])] != label[k]) return true;
  }
  return false;
}

void PlaneList::rename(const std::vector<std::int16_t>& target) {
  if (!isRenamed(target)) return;
  PlaneList renamed;
  for (int k = 0; k < size; ++k) {
    const std::int16_t to = target[static_cast<std::size_t>(label[k])];
    if (to >= 0) renamed.add(to);
  }
  *this = renamed;
}

PixelAssigner::PixelAssigner(const TiledCloud& cloud, const CellGrid& tiles,
                             const RangeNoise& noise, const OrganizedParams& params, int threads)
    : cloud_(cloud),
      tiles_(tiles),
      noise_(noise),
      params_(params),
      threads_(threads),
      labels_(static_cast<std::size_t>(cloud.tiles()) * kTileArea, -1),
      summaries_(static_cast<std::size_t>(cloud.tiles())),
      stale_(static_cast<std::size_t>(cloud.tiles()), 1),
      presence_(static_cast<std::size_t>(cloud.tiles())),
      grown_(static_cast<std::size_t>(cloud.tiles())),
      changed_(static_cast<std::size_t>(cloud.tiles()), 0) {
  for (int tile = 0; tile < cloud.tiles(); ++tile) {
    summaries_[static_cast<std::size_t>(tile)].free = static_cast<std::int16_t>(tiles.count(tile));
  }
}

void PixelAssigner::addCells(const CellGrid& grid, const std::vector<std::int16_t>& cell_labels) {
  const int cells_per_side = grid.columns / cloud_.columns;
  for (int row = 0; row < cloud_.rows; ++row) {
    for (int column = 0; column < cloud_.columns; ++column) {
      const auto tile = static_cast<std::size_t>(row) * cloud_.columns + column;
      const std::size_t first =
          (static_cast<std::size_t>(row) * grid.columns + column) * cells_per_side;
      bool whole = true;
      for (int r = 0; r < cells_per_side; ++r) {
        for (int c = 0; c < cells_per_side; ++c) {
          const std::int16_t label =
              cell_labels[first + static_cast<std::size_t>(r) * grid.columns + c];
          whole = whole && label == cell_labels[first];
          if (label < 0) continue;
          presence_[tile].add(label);
          changed_[tile] = 1;
        }
      }
      if (whole && cell_labels[first] >= 0) grown_[tile].add(cell_labels[first]);
    }
  }
}

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

void PixelAssigner::summarize(int tile) {
  std::int16_t* labels = labels_.data() + static_cast<std::size_t>(tile) * kTileArea;
  stale_[static_cast<std::size_t>(tile)] = 1;
  Summary& summary = summaries_[static_cast<std::size_t>(tile)];
  summary = {};
  int labelled = 0;
  summary.planes.size = static_cast<std::int16_t>(
      countLabels(labels, summary.planes.label, summary.count, PlaneList::kMost));
  for (int k = 0; k < summary.planes.size; ++k) labelled += summary.count[k];
  summary.free = static_cast<std::int16_t>(static_cast<int>(tiles_.count(tile)) - labelled);
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
  constexpr int kMostCandidates = 12;
  const int row = tile / cloud_.columns;
  const int column = tile % cloud_.columns;
  std::int16_t candidates[kMostCandidates];
  int count = 0;
  for (int r = std::max(0, row - reach); r <= std::min(cloud_.rows - 1, row + reach); ++r) {
    for (int c = std::max(0, column - reach); c <= std::min(cloud_.columns - 1, column + reach);
         ++c) {
      const PlaneList& held = presence_[static_cast<std::size_t>(r) * cloud_.columns + c];
      for (int k = 0; k < held.size; ++k) {
        const std::int16_t label = held.label[k];
        int at = 0;
        while (at < count && candidates[at] != label) ++at;
        if (at == count && count < kMostCandidates) candidates[count++] = label;
      }
    }
  }
  if (count == 0) return;
  const double border = isNoisy(tile) ? params_.blurred_border_share : params_.border_share;
  BandedPlane banded[kMostCandidates];
  for (int i = 0; i < count; ++i) {
    const PlaneCandidate& plane = planes[static_cast<std::size_t>(candidates[i])];
    BandedPlane& b = banded[i];
    for (int axis = 0; axis < 3; ++axis) b.normal[axis] = static_cast<float>(plane.normal[axis]);
    b.offset = static_cast<float>(plane.offset);
    // On the plane the noise along the ray counts by the cosine |sensor distance| / r.
    const double factor = params_.noise_factor * plane.distance(cloud_.sensor.data());
    const double squared_factor = factor * factor;
    const bool inside = reach == 0 || grown_[static_cast<std::size_t>(tile)].holds(candidates[i]);
    const double band = params_.distance_threshold * (inside ? 1.0 : border);
    b.constant = static_cast<float>(band * band);
    b.a = static_cast<float>(squared_factor * noise_.constant * noise_.constant);
    b.b = static_cast<float>(squared_factor * 2.0 * noise_.constant * noise_.quadratic);
    b.c = static_cast<float>(squared_factor * noise_.quadratic * noise_.quadratic);
    const double least =
        params_.noise_factor * params_.competing_share * params_.distance_threshold;
    b.least = static_cast<float>(least * least);
    b.label = candidates[i];
  }
  const float sensor[3] = {static_cast<float>(cloud_.sensor.x()),
                           static_cast<float>(cloud_.sensor.y()),
                           static_cast<float>(cloud_.sensor.z())};
  nearestInBand(cloud_.x(tile), cloud_.y(tile), cloud_.z(tile), sensor, banded, count,
                labels_.data() + static_cast<std::size_t>(tile) * kTileArea);
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
  updatePresence();
}

void PixelAssigner::updatePresence() {
  constexpr int kMinPresent = kTileArea / 4;
  for (std::size_t tile = 0; tile < summaries_.size(); ++tile) {
    const Summary& summary = summaries_[tile];
    PlaneList& present = presence_[tile];
    const std::int16_t before = present.size;
    for (int k = 0; k < summary.planes.size; ++k) {
      if (summary.count[k] >= kMinPresent) present.add(summary.planes.label[k]);
    }
    changed_[tile] = present.size != before;
  }
}

void PixelAssigner::fill(const std::vector<PlaneCandidate>& planes) {
  parallelFor(static_cast<std::size_t>(cloud_.rows), threads_, [&](std::size_t row) {
    for (int column = 0; column < cloud_.columns; ++column) {
      const int tile = static_cast<int>(row) * cloud_.columns + column;
      if (summaries_[static_cast<std::size_t>(tile)].free > 0) assignTile(tile, planes, 0);
    }
  });
}

std::vector<std::int64_t> PixelAssigner::counts(std::size_t planes) const {
  std::vector<std::int64_t> counts(planes, 0);
  for (const Summary& summary : summaries_) {
    for (int k = 0; k < summary.planes.size; ++k) {
      counts[static_cast<std::size_t>(summary.planes.label[k])] += summary.count[k];
    }
  }
  return counts;
}

const std::vector<TilePart>& PixelAssigner::parts() {
  std::vector<TilePart> parts;
  parts.reserve(summaries_.size() + summaries_.size() / 2);
  auto before = parts_.cbegin();
  for (int tile = 0; tile < cloud_.tiles(); ++tile) {
    const auto first = std::find_if(before, parts_.cend(),
                                    [&](const TilePart& part) { return part.tile >= tile; });
    before =
        std::find_if(first, parts_.cend(), [&](const TilePart& part) { return part.tile > tile; });
    if (std::exchange(stale_[static_cast<std::size_t>(tile)], 0) == 0) {
      parts.insert(parts.end(), first, before);
      continue;
    }
    const Summary& summary = summaries_[static_cast<std::size_t>(tile)];
    const auto finite = static_cast<std::int16_t>(tiles_.count(tile));
    const std::int16_t* labels = labels_.data() + static_cast<std::size_t>(tile) * kTileArea;
    for (int k = 0; k < summary.planes.size; ++k) {
      parts.emplace_back();
      TilePart& part = parts.back();
      part.tile = tile;
      part.label = summary.planes.label[k];
      part.finite = finite;
      if (summary.count[k] == finite) {
        addSums(part.sums, tiles_, tile);
      } else {
        sumLabelledPixels(cloud_, tile, labels, part.label, part.sums.data());
      }
    }
  }
  parts_.swap(parts);
  return parts_;
}

void PixelAssigner::relabel(const std::vector<std::int16_t>& target) {
  for (std::size_t tile = 0; tile < summaries_.size(); ++tile) {
    presence_[tile].rename(target);
    grown_[tile].rename(target);
    if (!summaries_[tile].planes.isRenamed(target)) continue;
    std::int16_t* labels = labels_.data() + tile * kTileArea;
    for (int i = 0; i < kTileArea; ++i) {
      if (labels[i] >= 0) labels[i] = target[static_cast<std::size_t>(labels[i])];
    }
    summarize(static_cast<int>(tile));
    changed_[tile] = 1;
  }
}

}  // namespace planar_mapping::detail
