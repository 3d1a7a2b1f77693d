// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "belief.h"
#include "depth_image.h"
#include "frame.h"

namespace planar_mapping::detail {
namespace {

/// A cell is missed only if everything measured over it lies behind it by this many resolutions.
constexpr double kMissMargin = 1.0;

/// Tells whether the sensor looks through cells.
class MissTest {
 public:
  MissTest(const MapData& map, const DepthImage& image)
      : image_(image),
        max_range_(map.params.max_range),
        margin_(kMissMargin * map.resolution()),
        // Half the diagonal of a square: holds a cell turned about any axis of it.
        half_(Vector3::Constant(std::sqrt(0.5) * map.resolution())) {
    image.bounds(max_range_, low_, high_);
  }

  bool reaches(const Vector3& low, const Vector3& high) const {
    return (low.array() <= high_.array()).all() && (high.array() >= low_.array()).all();
  }
  /// Can any cell of the box (half extents along the camera's axes) be missed?
  bool mayBeMissed(const Vector3& centre, const Vector3& half) const {
    const DepthImage::Look look = image_.look(centre, half, false);
    return look.visible && look.near <= max_range_ && look.farthest > look.near;
  }
  bool isMissed(const Vector3& centre) const {
    if (!image_.isResponsible(centre)) return false;
    const DepthImage::Look look = image_.look(centre, half_, true);
    return look.inside && look.far <= max_range_ && look.nearest > look.far + margin_;
  }
  const DepthImage& image() const { return image_; }

 private:
  const DepthImage& image_;
  const double max_range_;
  const double margin_;
  const Vector3 half_;
  Vector3 low_;
  Vector3 high_;
};

/// Lowers the belief of one cell. \return whether the cell is gone
bool miss(const PlanarMapParams& params, std::uint64_t& occupied, std::uint8_t& belief, int bit) {
  belief = afterMiss(belief, params.miss_factor);
  if (isKept(belief, params.min_probability)) return false;
  belief = 0;
  occupied &= ~(std::uint64_t{1} << bit);
  return true;
}

void missPlane(const MapData& map, Frame& frame, const MissTest& test, PlaneLayer& layer,
               const PlaneHits* hits) {
  const double s = map.resolution();
  Vector3 low, high;
  if (!layer.bounds(s, map.thickness(), low, high) || !test.reaches(low, high)) return;
  const Matrix3& r = test.image().inverseRotation();
  const Vector3 u = r * layer.frame.u;
  const Vector3 v = r * layer.frame.v;
  const Vector3 origin = test.image().toCamera(layer.frame.origin);
  const Vector3 half_tile = 4.0 * s * (u.cwiseAbs() + v.cwiseAbs()) + Vector3::Constant(s);
  for (std::size_t i = 0; i < layer.tiles.size(); ++i) {
    RasterTile& tile = layer.tiles.value(i);
    if (tile.occupied == 0) continue;
    std::int32_t ta = 0, tb = 0;
    unpackKey(layer.tiles.key(i), ta, tb);
    const Vector3 middle = origin + (8 * ta + 4) * s * u + (8 * tb + 4) * s * v;
    if (!test.mayBeMissed(middle, half_tile)) continue;
    const TileHits* seen = hits != nullptr ? hits->tiles.find(layer.tiles.key(i)) : nullptr;
    bool changed = false;
    for (std::uint64_t bits = tile.occupied; bits != 0; bits &= bits - 1) {
      const int bit = __builtin_ctzll(bits);
      const auto at = static_cast<std::size_t>(bit);
      if (seen != nullptr && seen->count[at] > 0) continue;
      const Vector3 centre =
          origin + (8 * ta + (bit & 7) + 0.5) * s * u + (8 * tb + (bit >> 3) + 0.5) * s * v;
      if (!test.isMissed(centre)) continue;
      changed = true;
      frame.update.cells_removed += miss(map.params, tile.occupied, tile.belief[at], bit) ? 1 : 0;
    }
    if (changed) layer.markDirty(ta, tb);
  }
}

void missCells(MapData& map, Frame& frame, const MissTest& test) {
  const double s = map.resolution();
  const auto frame_number = static_cast<std::uint32_t>(map.trajectory.size() - 1);
  const Vector3 half = test.image().extentInCamera(Vector3::Constant(2.0 * s));
  for (std::size_t r = 0; r < map.cells.regions.size(); ++r) {
    const Int3 region = unpackKey(map.cells.regions.key(r));
    const Vector3 low = s * (kRegionCells * Vector3(region.x, region.y, region.z) +
                             Vector3(map.cells.anchor.x, map.cells.anchor.y, map.cells.anchor.z));
    if (!test.reaches(low, low + Vector3::Constant(s * kRegionCells))) continue;
    // Regions of blocks there are exist already: marking them dirty moves nothing.
    const std::vector<std::uint64_t>& keys = map.cells.regions.value(r).blocks;
    for (const std::uint64_t key : keys) {
      CellBlock* block = map.cells.blocks.find(key);
      if (block == nullptr || block->occupied == 0) continue;
      const Int3 at = unpackKey(key);
      const Vector3 middle = (4.0 * s) * (Vector3(at.x, at.y, at.z) + Vector3::Constant(0.5));
      if (!test.mayBeMissed(test.image().toCamera(middle), half)) continue;
      std::uint64_t* seen = frame.cell_hits.find(key);
      std::uint64_t candidates = block->occupied & ~(seen != nullptr ? *seen : 0);
      bool changed = false;
      for (; candidates != 0; candidates &= candidates - 1) {
        const int bit = __builtin_ctzll(candidates);
        const Int3 c = CellLayer::cellOf(at, bit);
        const Vector3 centre = s * (Vector3(c.x, c.y, c.z) + Vector3::Constant(0.5));
        if (!test.isMissed(test.image().toCamera(centre))) continue;
        changed = true;
        // Once a frame, although a block may be listed twice.
        if (seen == nullptr) seen = &frame.cell_hits[key];
        *seen |= std::uint64_t{1} << bit;
        frame.update.cells_removed +=
            miss(map.params, block->occupied, block->belief[static_cast<std::size_t>(bit)], bit)
                ? 1
                : 0;
      }
      if (changed) map.cells.markDirty(at, frame_number);
    }
  }
}

}  // namespace

void integrateMisses(MapData& map, Frame& frame, const std::vector<DepthImage>& images) {
  if (map.params.miss_factor >= 1.0) return;
  std::vector<const PlaneHits*> hits_of(map.planes.size(), nullptr);
  for (const PlaneHits& hits : frame.hits) hits_of[hits.layer] = &hits;
  for (const DepthImage& image : images) {
    const MissTest test(map, image);
    for (std::size_t l = 0; l < map.planes.size(); ++l) {
      missPlane(map, frame, test, map.planes[l], hits_of[l]);
    }
    missCells(map, frame, test);
  }
}

}  // namespace planar_mapping::detail
