// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/tiles/plane_fit.h"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "planar_mapping/base/disjoint_parts.h"
#include "planar_mapping/planes/plane_search.h"

namespace planar_mapping::detail {
namespace {

/// Connected patches of all planes, over tiles that touch at a side or corner.
struct Patches {
  std::vector<std::int32_t> patch;       ///< of each part, within its plane, 0 = the largest
  std::vector<std::int32_t> count;       ///< per plane
  std::vector<std::int32_t> first_part;  ///< of each tile, and one past the last

  std::int32_t of(const std::vector<TilePart>& parts, std::size_t tile, std::int16_t label) const {
    std::int32_t part = first_part[tile];
    while (parts[static_cast<std::size_t>(part)].label != label) ++part;
    return patch[static_cast<std::size_t>(part)];
  }
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
};

// Row by row, so that every list is ascending.
void listInliers(const TiledCloud& cloud, const std::vector<std::int16_t>& labels,
                 const std::vector<TilePart>& parts, const Patches& patches,
                 std::vector<Cursor>& cursors) {
  for (int row = 0; row < cloud.height; ++row) {
    const std::size_t first_tile = static_cast<std::size_t>(row / kTileSide) * cloud.columns;
    for (int column = 0; column < cloud.width; column += kQuarterSide) {
      const std::size_t tile = first_tile + column / kTileSide;
      const std::int16_t* four =
          labels.data() + tile * kTileArea + pixelInTile(row % kTileSide, column % kTileSide);
      const int index = row * cloud.width + column;
      std::uint64_t all = 0;
      static_assert(sizeof(all) == kQuarterSide * sizeof(*four), "compared at once");
      std::memcpy(&all, four, sizeof(all));
      if (all == ~std::uint64_t{0}) continue;  // no plane here
      if (all == static_cast<std::uint16_t>(four[0]) * std::uint64_t{0x0001000100010001}) {
        Cursor& cursor = cursors[static_cast<std::size_t>(four[0])];
        for (int k = 0; k < kQuarterSide; ++k) cursor.inlier[k] = index + k;
        cursor.inlier += kQuarterSide;
        if (!cursor.patch) continue;
        std::fill_n(cursor.patch, kQuarterSide, patches.of(parts, tile, four[0]));
        cursor.patch += kQuarterSide;
        continue;
      }
      for (int i = 0; i < kQuarterSide;) {
        const std::int16_t label = four[i];
        const int begin = i;
        while (i < kQuarterSide && four[i] == label) ++i;
        if (label < 0) continue;
        Cursor& cursor = cursors[static_cast<std::size_t>(label)];
        for (int k = begin; k < i; ++k) *cursor.inlier++ = index + k;
        if (!cursor.patch) continue;
        const std::int32_t patch = patches.of(parts, tile, label);
        for (int k = begin; k < i; ++k) *cursor.patch++ = patch;
      }
    }
  }
}

}  // namespace

void listSegments(const PointsView& points, const TiledCloud& cloud,
                  const std::vector<std::int16_t>& labels, const std::vector<TilePart>& parts,
                  double patch_gap, const std::vector<PlaneSegment*>& segments) {
  const bool by_tiles = !(patch_gap > 0.0);
  const Patches patches = connect(parts, cloud, segments.size());
  std::vector<double> inliers(segments.size(), 0.0);
  for (const TilePart& part : parts) inliers[static_cast<std::size_t>(part.label)] += part.sums[kN];
  std::vector<Cursor> cursors(segments.size());
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (segments[i] == nullptr) continue;
    PlaneSegment& segment = *segments[i];
    const auto number = static_cast<std::size_t>(inliers[i]);
    segment.inliers.resize(number);
    cursors[i].inlier = segment.inliers.data();
    if (!by_tiles) continue;
    segment.number_of_patches = patches.count[i];
    if (segment.number_of_patches < 2) continue;
    segment.patches.resize(number);
    cursors[i].patch = segment.patches.data();
  }
  listInliers(cloud, labels, parts, patches, cursors);
  if (by_tiles) return;
  for (PlaneSegment* segment : segments) {
    if (segment != nullptr) findPatches(points, patch_gap, *segment);
  }
}

}  // namespace planar_mapping::detail
