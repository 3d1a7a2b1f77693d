// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/disparity/disparity_assignment.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "base/organized_lanes.h"
#include "planar_mapping/core/base/detail/parallel.h"
#include "planar_mapping/core/base/detail/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr float kFar = 3e38F;
constexpr std::int16_t kNoCandidate = -1;
constexpr std::int16_t kCandidates = std::numeric_limits<std::int16_t>::max();

/// What a tile and those beside it hold together, from one row of tiles and its neighbours.
PLANAR_MAPPING_MULTIVERSION
void joinOnly(const std::int16_t* above, const std::int16_t* row, const std::int16_t* below,
              int columns, std::int16_t* joined) {
  const std::int16_t* rows[3] = {above, row, below};
  for (int c = 0; c < columns; ++c) joined[c] = kNoCandidate;
  for (const std::int16_t* line : rows) {
    for (int shift = -1; shift <= 1; ++shift) {
      const int first = shift < 0 ? 1 : 0;
      const int last = shift > 0 ? columns - 1 : columns;
      for (int c = first; c < last; ++c) {
        const std::int16_t other = line[c + shift];
        const std::int16_t so_far = joined[c];
        const std::int16_t both = so_far == kNoCandidate || so_far == other ? other : kCandidates;
        joined[c] = other == kNoCandidate ? so_far : both;
      }
    }
  }
}

/// A plane as the pixel loop wants it; its band is max(constant, relative * D).
struct BandedDisparity {
  float p, q, r;
  float constant, relative;
  std::int16_t label;
};

// Each pixel to the plane nearest in disparity whose band it lies in.
PLANAR_MAPPING_MULTIVERSION
void nearestDisparity(const float* x, const float* y, const float* d, const BandedDisparity* planes,
                      int count, std::int16_t* labels) {
  const FloatLanes zero = {};
  for (int k = 0; k < kTileArea; k += kLanes) {
    FloatLanes px, py, pd;
    load(x + k, px);
    load(y + k, py);
    load(d + k, pd);
    IntLanes label = IntLanes{} - 1;
    FloatLanes best = zero + kFar;
    for (int plane = 0; plane < count; ++plane) {
      const BandedDisparity& b = planes[plane];
      const FloatLanes error = pd - (b.p * px + b.q * py + b.r);
      const FloatLanes distance = error < 0.0F ? -error : error;
      const FloatLanes relative = b.relative * pd;
      const FloatLanes constant = zero + b.constant;
      const FloatLanes band = relative > constant ? relative : constant;
      // Comparisons with NaN are false: pixels without a point stay free.
      const FloatLanes score = distance <= band ? distance : zero + kFar;
      label = score < best ? IntLanes{} + b.label : label;
      best = score < best ? score : best;
    }
    store(label, labels + k);
  }
}

/// Of a tile; unlike std::replace() it writes all labels, so that it is vectorised.
PLANAR_MAPPING_MULTIVERSION
void replaceLabel(std::int16_t* labels, std::int16_t from, std::int16_t to) {
  for (int k = 0; k < kTileArea; ++k) labels[k] = labels[k] == from ? to : labels[k];
}

// Finite pixels of the quarters of a tile that hold pixels with a label.
PLANAR_MAPPING_MULTIVERSION
int countFiniteAround(const float* x, const std::int16_t* labels, std::int16_t label) {
  int all = 0;
  for (int quarter = 0; quarter < kTileArea; quarter += kQuarterArea) {
    int finite = 0;
    int held = 0;
    for (int k = quarter; k < quarter + kQuarterArea; ++k) {
      finite += x[k] == x[k] ? 1 : 0;
      held += labels[k] == label ? 1 : 0;
    }
    all += held > 0 ? finite : 0;
  }
  return all;
}

}  // namespace

DisparityAssigner::DisparityAssigner(const TiledCloud& cloud)
    : cloud_(cloud),
      labels_(static_cast<std::size_t>(cloud.tiles()) * kTileArea, -1),
      presence_(static_cast<std::size_t>(cloud.tiles())),
      joined_(static_cast<std::size_t>(cloud.tiles()), 0) {}

void DisparityAssigner::addCells(const CellGrid& grid,
                                 const std::vector<std::int16_t>& cell_labels) {
  const int cells_per_side = grid.columns / cloud_.columns;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const std::int16_t label = cell_labels[static_cast<std::size_t>(row) * grid.columns + column];
      if (label < 0) continue;
      const auto tile =
          static_cast<std::size_t>(row / cells_per_side) * cloud_.columns + column / cells_per_side;
      presence_[tile].add(label);
    }
  }
}

PlaneList DisparityAssigner::candidatesOf(int tile) const {
  const int row = tile / cloud_.columns;
  const int column = tile % cloud_.columns;
  // Its own planes first: a list holds a few only.
  PlaneList list = presence_[static_cast<std::size_t>(tile)];
  for (int r = std::max(0, row - 1); r <= std::min(cloud_.rows - 1, row + 1); ++r) {
    for (int c = std::max(0, column - 1); c <= std::min(cloud_.columns - 1, column + 1); ++c) {
      const PlaneList& other = presence_[static_cast<std::size_t>(r * cloud_.columns + c)];
      for (int k = 0; k < other.size; ++k) list.add(other.label[k]);
    }
  }
  return list;
}

void DisparityAssigner::findOnlyCandidates() {
  std::vector<std::int16_t> own(presence_.size());
  for (std::size_t i = 0; i < own.size(); ++i) {
    own[i] = presence_[i].size == 0   ? kNoCandidate
             : presence_[i].size == 1 ? presence_[i].label[0]
                                      : kCandidates;
  }
  only_.resize(presence_.size());
  for (int row = 0; row < cloud_.rows; ++row) {
    const auto line = [&](int r) {
      return own.data() + std::clamp(r, 0, cloud_.rows - 1) * cloud_.columns;
    };
    joinOnly(line(row - 1), line(row), line(row + 1), cloud_.columns,
             only_.data() + row * cloud_.columns);
  }
}

void DisparityAssigner::assign(const std::vector<DisparityPlane>& planes,
                               const DisparityParams& params, double share, double factor,
                               int threads) {
  findOnlyCandidates();
  std::vector<std::vector<TilePart>> parts(static_cast<std::size_t>(cloud_.rows));
  parallelFor(static_cast<std::size_t>(cloud_.rows), threads, [&](std::size_t row) {
    BandedDisparity banded[PlaneList::kMost];
    std::int16_t before[kTileArea];
    parts[row].reserve(static_cast<std::size_t>(2 * cloud_.columns));
    auto old =
        std::lower_bound(parts_.begin(), parts_.end(), static_cast<int>(row) * cloud_.columns,
                         [](const TilePart& part, int tile) { return part.tile < tile; });
    for (int column = 0; column < cloud_.columns; ++column) {
      const int tile = static_cast<int>(row) * cloud_.columns + column;
      std::int16_t* labels = labels_.data() + static_cast<std::size_t>(tile) * kTileArea;
      PlaneList list;
      const std::int16_t only = only_[static_cast<std::size_t>(tile)];
      if (only == kCandidates) {
        list = candidatesOf(tile);
      } else if (only != kNoCandidate) {
        list.add(only);
      }
      int count = 0;
      for (int k = 0; k < list.size; ++k) {
        const DisparityPlane& plane = planes[static_cast<std::size_t>(list.label[k])];
        if (!plane.valid) continue;
        banded[count++] = {static_cast<float>(plane.p),
                           static_cast<float>(plane.q),
                           static_cast<float>(plane.r),
                           static_cast<float>(params.tolerance(factor)),
                           static_cast<float>(plane.pixels(share * params.distance_threshold, 1.0)),
                           list.label[k]};
      }
      if (count == 0) {
        std::fill_n(labels, kTileArea, std::int16_t{-1});
        continue;
      }
      std::memcpy(before, labels, sizeof(before));
      nearestDisparity(cloud_.x(tile), cloud_.y(tile), cloud_.z(tile), banded, count, labels);
      while (old != parts_.end() && old->tile < tile) ++old;
      const bool same = joined_[static_cast<std::size_t>(tile)] == 0 &&
                        std::memcmp(before, labels, sizeof(before)) == 0;
      for (int k = 0; k < count; ++k) {
        if (same) {
          auto part = old;
          while (part != parts_.end() && part->tile == tile && part->label != banded[k].label) {
            ++part;
          }
          if (part != parts_.end() && part->tile == tile) parts[row].push_back(*part);
          continue;
        }
        TilePart part;
        part.tile = tile;
        part.label = banded[k].label;
        sumLabelledPixels(cloud_, tile, labels, part.label, part.sums.data());
        if (!(part.sums[kN] > 0.0)) continue;
        part.finite =
            static_cast<std::int16_t>(countFiniteAround(cloud_.x(tile), labels, part.label));
        parts[row].push_back(part);
      }
    }
  });
  std::fill(joined_.begin(), joined_.end(), 0);
  parts_.clear();
  std::size_t number = 0;
  for (const std::vector<TilePart>& row : parts) number += row.size();
  parts_.reserve(number);
  for (const std::vector<TilePart>& row : parts)
    parts_.insert(parts_.end(), row.begin(), row.end());
  std::fill(presence_.begin(), presence_.end(), PlaneList());
  for (const TilePart& part : parts_) {
    if (part.sums[kN] >= params.min_presence) {
      presence_[static_cast<std::size_t>(part.tile)].add(part.label);
    }
  }
}

void DisparityAssigner::relabel(const std::vector<std::int16_t>& target) {
  bool same = true;
  for (std::size_t i = 0; i < target.size(); ++i) same &= target[i] == static_cast<std::int16_t>(i);
  if (same) return;
  for (PlaneList& list : presence_) list.rename(target);
  // A tile's pixels have the labels of its parts. A plane becomes one that stays, so that labels of
  // one tile may be renamed one after the other.
  std::size_t kept = 0;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    TilePart part = parts_[i];
    const std::int16_t from = part.label;
    part.label = target[static_cast<std::size_t>(from)];
    if (part.label != from) {
      replaceLabel(labels_.data() + static_cast<std::size_t>(part.tile) * kTileArea, from,
                   part.label);
    }
    if (part.label < 0) continue;
    // Parts of planes that became one are one as well.
    std::size_t before = kept;
    while (before > 0 && parts_[before - 1].tile == part.tile &&
           parts_[before - 1].label != part.label) {
      --before;
    }
    if (before > 0 && parts_[before - 1].tile == part.tile) {
      addSums(parts_[before - 1].sums, part.sums);
      joined_[static_cast<std::size_t>(part.tile)] = 1;
    } else {
      parts_[kept++] = part;
    }
  }
  parts_.resize(kept);
}

}  // namespace planar_mapping::detail
