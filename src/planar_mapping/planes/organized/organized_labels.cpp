// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <utility>

#include "planar_mapping/base/simd.h"
#include "planar_mapping/planes/organized/organized_assignment.h"

namespace planar_mapping::detail {
namespace {

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

bool PlaneList::holds(std::int16_t plane) const {
  for (int k = 0; k < size; ++k) {
    if (label[k] == plane) return true;
  }
  return false;
}

void PlaneList::add(std::int16_t plane) {
  if (size < kMax && !holds(plane)) label[size++] = plane;
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

PixelLabels::PixelLabels(const TiledCloud& cloud, const CellGrid& tiles, bool by_quarters,
                         int threads)
    : cloud_(cloud),
      tiles_(tiles),
      threads_(threads),
      labels_(static_cast<std::size_t>(cloud.tiles()) * kTileArea, -1),
      summaries_(static_cast<std::size_t>(cloud.tiles())),
      presence_(summaries_.size()),
      grown_(summaries_.size()),
      changed_(summaries_.size(), 0),
      by_quarters_(by_quarters),
      stale_(summaries_.size(), 1) {
  for (int tile = 0; tile < cloud.tiles(); ++tile) {
    summaries_[static_cast<std::size_t>(tile)].free = static_cast<std::int16_t>(tiles.count(tile));
  }
}

void PixelLabels::addCells(const CellGrid& grid, const std::vector<std::int16_t>& cell_labels) {
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

void PixelLabels::summarize(int tile) {
  std::int16_t* labels = labels_.data() + static_cast<std::size_t>(tile) * kTileArea;
  stale_[static_cast<std::size_t>(tile)] = 1;
  Summary& summary = summaries_[static_cast<std::size_t>(tile)];
  summary = {};
  int labelled = 0;
  summary.planes.size = static_cast<std::int16_t>(
      countLabels(labels, summary.planes.label, summary.count, PlaneList::kMax));
  for (int k = 0; k < summary.planes.size; ++k) labelled += summary.count[k];
  summary.free = static_cast<std::int16_t>(static_cast<int>(tiles_.count(tile)) - labelled);
}

void PixelLabels::updatePresence(int min_pixels, bool anew) {
  for (std::size_t tile = 0; tile < summaries_.size(); ++tile) {
    const Summary& summary = summaries_[tile];
    PlaneList& present = presence_[tile];
    if (anew) present = PlaneList();
    const std::int16_t before = present.size;
    for (int k = 0; k < summary.planes.size; ++k) {
      if (summary.count[k] >= min_pixels) present.add(summary.planes.label[k]);
    }
    changed_[tile] = present.size != before;
  }
}

int PixelLabels::planesAround(int tile, int reach, std::int16_t* planes) const {
  const int row = tile / cloud_.columns;
  const int column = tile % cloud_.columns;
  const int left = std::max(0, column - reach);
  const int right = std::min(cloud_.columns - 1, column + reach);
  int count = 0;
  const auto add = [&](const PlaneList& held) {
    for (int k = 0; k < held.size; ++k) {
      int at = 0;
      while (at < count && planes[at] != held.label[k]) ++at;
      if (at == count && count < kMaxAround) planes[count++] = held.label[k];
    }
  };
  add(presence_[static_cast<std::size_t>(tile)]);
  for (int r = std::max(0, row - reach); r <= std::min(cloud_.rows - 1, row + reach); ++r) {
    const PlaneList* line = presence_.data() + static_cast<std::size_t>(r) * cloud_.columns;
    for (const PlaneList* held = line + left; held <= line + right; ++held) {
      // No plane around a tile, or one, is most of an image.
      if (held->size == 0 || (held->size == 1 && count > 0 && held->label[0] == planes[0]))
        continue;
      add(*held);
    }
  }
  return count;
}

bool PixelLabels::isInside(int tile) const {
  const std::int16_t plane = wholePlane(tile);
  const int row = tile / cloud_.columns;
  const int column = tile % cloud_.columns;
  if (plane < 0) return false;
  for (int r = std::max(0, row - 1); r <= std::min(cloud_.rows - 1, row + 1); ++r) {
    for (int c = std::max(0, column - 1); c <= std::min(cloud_.columns - 1, column + 1); ++c) {
      if (wholePlane(r * cloud_.columns + c) != plane) return false;
    }
  }
  return true;
}

std::vector<std::int64_t> PixelLabels::counts(std::size_t planes) const {
  std::vector<std::int64_t> counts(planes, 0);
  for (const Summary& summary : summaries_) {
    for (int k = 0; k < summary.planes.size; ++k) {
      counts[static_cast<std::size_t>(summary.planes.label[k])] += summary.count[k];
    }
  }
  return counts;
}

const std::vector<TilePart>& PixelLabels::parts() {
  if (std::find(stale_.begin(), stale_.end(), 1) == stale_.end()) return parts_;
  std::vector<TilePart> parts;
  parts.reserve(summaries_.size() + summaries_.size() / 2);
  auto before = parts_.cbegin();
  for (int tile = 0; tile < cloud_.tiles(); ++tile) {
    const auto first = before;
    while (before != parts_.cend() && before->tile == tile) ++before;
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
      part.finite =
          by_quarters_
              ? static_cast<std::int16_t>(countFiniteAround(cloud_.x(tile), labels, part.label))
              : finite;
      if (summary.count[k] == finite) {
        part.sums = sumsOf(tiles_, tile);
      } else {
        sumLabelledPixels(cloud_.x(tile), labels, part.label, part.sums.data());
      }
    }
  }
  parts_.swap(parts);
  return parts_;
}

void PixelLabels::relabel(const std::vector<std::int16_t>& target) {
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
