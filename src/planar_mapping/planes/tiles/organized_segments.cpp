// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/tiles/plane_fit.h"

#include <algorithm>
#include <numeric>

#include "planar_mapping/base/disjoint_parts.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/planes/plane_search.h"

namespace planar_mapping::detail {
namespace {

/// Connected patches of all planes, over tiles that touch at a side or corner.
struct Patches {
  std::vector<std::int32_t> patch;       ///< of each part, within its plane, 0 = the largest
  std::vector<std::int32_t> count;       ///< per plane
  std::vector<std::int32_t> first_part;  ///< of each tile, and one past the last
};

Patches connect(const std::vector<TilePart>& parts, const TiledCloud& cloud, std::size_t planes) {
  Patches result;
  result.first_part.assign(static_cast<std::size_t>(cloud.tiles()) + 1, 0);
  for (const TilePart& part : parts) ++result.first_part[static_cast<std::size_t>(part.tile) + 1];
  std::partial_sum(result.first_part.begin(), result.first_part.end(), result.first_part.begin());
  DisjointParts united(parts.size());  // each has the number of its first part
  for (std::uint32_t i = 0; i < parts.size(); ++i) {
    const int row = parts[i].tile / cloud.columns;
    const int column = parts[i].tile % cloud.columns;
    constexpr int kBefore[4][2] = {{-1, -1}, {-1, 0}, {-1, 1}, {0, -1}};
    for (const auto& step : kBefore) {
      const int c = column + step[1];
      if (row + step[0] < 0 || c < 0 || c >= cloud.columns) continue;
      const auto tile = static_cast<std::size_t>((row + step[0]) * cloud.columns + c);
      const auto end = static_cast<std::uint32_t>(result.first_part[tile + 1]);
      for (auto k = static_cast<std::uint32_t>(result.first_part[tile]); k < end; ++k) {
        if (parts[k].label != parts[i].label) continue;
        const auto [first, last] = std::minmax({united.of(k), united.of(i)});
        united.unite(last, first);
      }
    }
  }
  std::vector<double> points(parts.size(), 0.0);
  std::vector<std::uint32_t> roots;
  for (std::uint32_t i = 0; i < parts.size(); ++i) {
    const std::uint32_t root = united.of(i);
    points[root] += parts[i].sums[kN];
    if (root == i) roots.push_back(root);
  }
  std::stable_sort(roots.begin(), roots.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return points[a] > points[b]; });
  result.count.assign(planes, 0);
  result.patch.assign(parts.size(), 0);
  for (const std::uint32_t root : roots) {
    result.patch[root] = result.count[static_cast<std::size_t>(parts[root].label)]++;
  }
  for (std::uint32_t i = 0; i < parts.size(); ++i) result.patch[i] = result.patch[united.of(i)];
  return result;
}

/// Where the next inlier of a plane goes; patch is null for a plane of one patch.
struct Cursor {
  int* inlier = nullptr;
  std::int32_t* patch = nullptr;

  void add(int index, std::int32_t of) {
    *inlier++ = index;
    if (patch) *patch++ = of;
  }
};

// Row by row, so that every list is ascending: those of a row of tiles, from the cursors on.
void listInliers(const TiledCloud& cloud, int tile_row, const std::vector<std::int16_t>& labels,
                 const std::vector<TilePart>& parts, const Patches& patches,
                 std::vector<Cursor>& cursors) {
  const int end = std::min(cloud.height, (tile_row + 1) * kTileSide);
  for (int row = tile_row * kTileSide; row < end; ++row) {
    for (int column = 0; column < cloud.width; column += kTileSide) {
      const auto tile = static_cast<std::size_t>(tile_row * cloud.columns + column / kTileSide);
      const auto first = static_cast<std::size_t>(patches.first_part[tile]);
      const auto last = static_cast<std::size_t>(patches.first_part[tile + 1]);
      const int index = row * cloud.width + column;
      if (first == last) continue;
      if (parts[first].sums[kN] == kTileArea) {
        Cursor& cursor = cursors[static_cast<std::size_t>(parts[first].label)];
        for (int k = 0; k < kTileSide; ++k) cursor.inlier[k] = index + k;
        cursor.inlier += kTileSide;
        if (!cursor.patch) continue;
        std::fill_n(cursor.patch, kTileSide, patches.patch[first]);
        cursor.patch += kTileSide;
        continue;
      }
      std::size_t part = first;
      for (int half = 0; half < kTileSide; half += kQuarterSide) {
        const std::int16_t* four =
            labels.data() + tile * kTileArea + pixelInTile(row % kTileSide, half);
        for (int k = 0; k < kQuarterSide; ++k) {
          if (four[k] < 0) continue;
          if (parts[part].label != four[k]) part = first;
          while (parts[part].label != four[k]) ++part;
          cursors[static_cast<std::size_t>(four[k])].add(index + half + k, patches.patch[part]);
        }
      }
    }
  }
}

}  // namespace

void listSegments(const PointsView& points, const TiledCloud& cloud,
                  const std::vector<std::int16_t>& labels, const std::vector<TilePart>& parts,
                  double patch_gap, int threads, const std::vector<PlaneSegment*>& segments) {
  const bool by_tiles = !(patch_gap > 0.0);
  const Patches patches = connect(parts, cloud, segments.size());
  std::vector<std::size_t> inliers(segments.size(), 0);
  std::vector<std::vector<std::size_t>> before(static_cast<std::size_t>(cloud.rows));
  auto part = parts.begin();
  for (int row = 0; row < cloud.rows; ++row) {
    before[static_cast<std::size_t>(row)] = inliers;
    for (; part != parts.end() && part->tile < (row + 1) * cloud.columns; ++part)
      inliers[static_cast<std::size_t>(part->label)] += static_cast<std::size_t>(part->sums[kN]);
  }
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (segments[i] == nullptr) continue;
    PlaneSegment& segment = *segments[i];
    segment.inliers.resize(inliers[i]);
    if (!by_tiles) continue;
    segment.number_of_patches = patches.count[i];
    if (segment.number_of_patches > 1) segment.patches.resize(inliers[i]);
  }
  parallelFor(static_cast<std::size_t>(cloud.rows), threads, [&](std::size_t row) {
    std::vector<Cursor> cursors(segments.size());
    for (std::size_t i = 0; i < segments.size(); ++i) {
      if (segments[i] == nullptr) continue;
      cursors[i].inlier = segments[i]->inliers.data() + before[row][i];
      if (!segments[i]->patches.empty())
        cursors[i].patch = segments[i]->patches.data() + before[row][i];
    }
    listInliers(cloud, static_cast<int>(row), labels, parts, patches, cursors);
  });
  if (by_tiles) return;
  for (PlaneSegment* segment : segments) {
    if (segment != nullptr) findPatches(points, patch_gap, *segment);
  }
}

}  // namespace planar_mapping::detail
