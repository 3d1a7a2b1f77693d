// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>

#include "planar_mapping/map/integration/frame.h"
#include "planar_mapping/map/sensor/depth_image.h"
#include "planar_mapping/map/store/belief.h"

namespace planar_mapping::detail {
namespace {

/// A cell is missed only if all that is measured over it lies behind it by so many resolutions, ...
constexpr double kMissMargin = 0.5;
constexpr double kMissMarginFar = 1.0;  // of a scan, or with a known depth error
/// ... and so much of what it covers in the image is measured: cameras have holes at edges and
/// where little is reflected, and a leg that is narrower than a cell is often no more than a hole.
constexpr double kSeenThrough = 0.6;
/// How densely the rays of a scanner lie is counted within so many times the size of a cell.
constexpr double kAround = 4.0;
/// Of a scan only a ray that passes within so many resolutions of the middle of a cell looks
/// through it: those farther off pass above or below a bar in it, ...
constexpr double kMiddle = 0.35;
/// ... and so may that one, unless rays lie no more than so many resolutions apart. ...
constexpr double kDense = 0.75;
/// ... Where they lie farther apart it counts for a third of a look.
constexpr int kThinLook = 1;
constexpr int kWholeLook = 3;
/// But no bar fills a square of a plane with so many cells along a side. If all of them are passed,
/// looks through any are looks through all, ...
constexpr int kMinSide = 3;
constexpr int kMaxSide = 5;
/// ... and so many at least if it is wider than rays lie apart.
constexpr int kWideLook = 2 * kWholeLook;
/// So many points before a cell for each ray that passes it do not hide it.
constexpr double kStray = 0.25;
/// And a ray that passes a cell may meet the same floor or wall farther on: not by more than this
/// fraction of its depth, unless the sensor is all but in that wall.
constexpr double kGrazing = 0.2;
/// Likewise of a stereo camera, where what is behind is no part of the map: noise lies there, too.
constexpr double kSeenThroughNoise = 0.8;
/// A cell without a point is doubted only if so many pixels face it, ...
constexpr double kMinPixels = 9.0;
/// ... and what is measured over it is not nearer than it by so many resolutions and depth errors:
/// then it is hidden, not missing.
constexpr double kHiddenCells = 3.0;
constexpr double kHiddenErrors = 3.0;
/// A cell in front of which something is measured is behind a surface, unless that is within so
/// many depth errors of it.
constexpr double kBehindErrors = 2.0;

/// A cell that got no point of the frame, as planes and non-planar cells see it.
struct UnseenCell {
  Vector3 centre;       ///< in the camera's frame
  double facing = 1.0;  ///< cosine between its surface and the ray; 1 for a cell without one
  double errors = 0.0;  ///< so many depth errors behind what is measured it is still looked at
  bool is_planar = true;
  bool is_proven = true;  ///< one look that does not confirm it is not enough to lose it
};

/// In place of thirds of looks, of a cell that rays do not pass. Where they pass it, if not in its
/// middle, there are 0.
constexpr int kNotPassed = -1000;

/// Tells whether the sensor looks through cells.
class MissTest {
 public:
  MissTest(const MapData& map, const Frame& frame, const DepthImage& image)
      : image_(image),
        noise_(frame.observation->noise),
        max_range_(map.missRange()),
        resolution_(map.resolution()),
        margin_((noise_ || image.isOfScan() ? kMissMarginFar : kMissMargin) * map.resolution()),
        // Half the diagonal of a square: holds a cell turned about any axis of it.
        half_(Vector3::Constant(std::sqrt(0.5) * map.resolution())),
        bounds_(image.bounds(max_range_)) {}

  bool reaches(const Eigen::AlignedBox3d& box) const { return bounds_.intersects(box); }
  /// Can any cell of the box (half extents along the camera's axes) be missed?
  bool mayBeMissed(const Vector3& centre, const Vector3& half) const {
    const double behind = noise_ ? kBehindErrors * noise_->depthError(centre.z() + half.z()) : 0.0;
    const DepthImage::Look look = image_.look(centre, half, false);
    return look.visible && look.near <= max_range_ &&
           look.farthest > look.near - resolution_ - behind;
  }
  /// How much less is the cell to be believed in, in thirds of looks: because the sensor looks
  /// through it, or because it looks where the cell is and measures other places there?
  int looksThrough(const UnseenCell& cell) const {
    if (!image_.isResponsible(cell.centre)) return kNotPassed;
    const int looks = image_.isSparse() ? looksBetweenRays(cell) : looksOfPixels(cell);
    // Without a depth error nobody knows whether what is measured beside the cell is of it.
    if (looks > 0 || !noise_ || !isMissingWhereMeasured(cell)) return looks;
    return kWholeLook;
  }
  /// Metres between the rays of a scan about a place.
  double spacingAt(const Vector3& centre) const {
    return image_.tileSide(centre.z()) / image_.coverOf(centre, kAround * half_).measured;
  }
  const DepthImage& image() const { return image_; }

 private:
  int looksBetweenRays(const UnseenCell& cell) const {
    const DepthImage::Look all = image_.look(cell.centre, half_, true);
    if (!all.inside || all.far > max_range_ || !isPassed(cell, all, all.far + margin_))
      return kNotPassed;
    return passedByRays(cell, all);
  }
  /// Of what the edge of the image cuts, the part that is seen; that of a cell with its middle.
  int looksOfPixels(const UnseenCell& cell) const {
    const DepthImage::Look all = image_.look(cell.centre, half_, false);
    if (all.far > max_range_ ||
        !(all.inside || image_.look(cell.centre, Vector3::Zero(), true).inside))
      return kNotPassed;
    if (all.nearest > all.far + margin_) return passedByPixels(cell);
    return !cell.is_planar && isCrossed(cell) ? kWholeLook : kNotPassed;
  }
  /// Does all that a scan measured over the cell lie beyond a depth, but for single points before
  /// it, which edges of things in between leave in the air?
  bool isPassed(const UnseenCell& cell, const DepthImage::Look& all, double depth) const {
    if (all.nearest > depth) return true;
    const DepthImage::Sides sides = image_.sidesOf(cell.centre, half_, all.near - margin_, depth);
    return sides.at == 0 && sides.before <= kStray * sides.beyond;
  }
  /// Do nearly all rays that cross a cell without a plane end behind it, though others that pass
  /// below it end on a floor nearer than its far side?
  bool isCrossed(const UnseenCell& cell) const {
    const double radius = 0.5 * resolution_;
    const DepthImage::Crossing rays = image_.crossingOf(cell.centre, radius, radius + margin_);
    return rays.rays > 0 && rays.beyond >= kSeenThroughNoise * rays.rays;
  }
  /// Is enough measured over a cell that all which is measured over it lies beyond? Thirds of
  /// looks.
  int passedByPixels(const UnseenCell& cell) const {
    const DepthImage::Cover cover = image_.coverOf(cell.centre, half_);
    if (cover.is_complete) return kWholeLook;
    const bool is_sure = !noise_ || image_.coverOf(cell.centre, 0.5 * half_).is_used;
    const double enough = is_sure ? kSeenThrough : kSeenThroughNoise;
    return cover.measured >= enough ? kWholeLook : kNotPassed;
  }
  /// Does a ray pass the middle of the cell? Where there are gaps between rays all of them have to
  /// end far behind it, too; where there are none, what was hit once is lost at once.
  int passedByRays(const UnseenCell& cell, const DepthImage::Look& all) const {
    const double enough = noise_ ? kSeenThroughNoise : kSeenThrough;
    double beyond = half_.x() / std::abs(cell.facing);
    if (image_.coverOf(cell.centre, half_).measured < enough) {
      beyond = std::max(kGrazing * cell.centre.z(), beyond);
    } else if (!cell.is_proven) {
      return kWholeLook;
    }
    if (beyond > margin_ && !isPassed(cell, all, all.far + beyond)) return kNotPassed;
    if (!image_.isPassedWithin(cell.centre, kMiddle * resolution_)) return 0;
    return spacingAt(cell.centre) <= kDense * resolution_ ? kWholeLook : kThinLook;
  }
  bool isMissingWhereMeasured(const UnseenCell& cell) const {
    // Half the cell is enough to expect points of it, and edges of what hides others matter less.
    const DepthImage::Look look = image_.look(cell.centre, 0.5 * half_, true);
    if (!look.inside || !(look.far <= max_range_)) return false;
    const double error = noise_->depthError(cell.centre.z());
    if (cell.facing * image_.pixelsOf(resolution_, cell.centre.z()) < kMinPixels ||
        !(look.farthest > look.near - resolution_ - cell.errors * error)) {
      return false;
    }
    // What is no part of the map does not tell against it.
    const DepthImage::Cover cover = image_.coverOf(cell.centre, 0.5 * half_);
    // Where some pixels have no measurement, the others speak for them against what is not proven.
    if (!cover.is_complete) return !cell.is_proven && cover.is_used;
    const double hidden = kHiddenCells * resolution_ + kHiddenErrors * error;
    return look.nearest > look.near - hidden && cover.is_all_used;
  }

  const DepthImage& image_;
  const std::optional<StereoNoise> noise_;
  const double max_range_;
  const double resolution_;
  const double margin_;
  const Vector3 half_;
  const Eigen::AlignedBox3d bounds_;
};

/// Lowers the belief of one cell of a tile or block. \return whether the cell is gone
template <typename Cells>
bool miss(const PlanarMapParams& params, Cells& cells, std::size_t bit, int looks) {
  const double whole = static_cast<double>(looks) / kWholeLook;
  const std::uint8_t belief = afterMiss(cells.belief(bit), std::pow(params.miss_factor, whole));
  if (!isKept(belief, params.min_probability)) {
    cells.remove(bit);
    return true;
  }
  cells.setBelief(bit, belief);
  return false;
}

/// Of the cells of a tile, bit 8 b + a, thirds of looks.
struct TileLooks {
  std::array<int, 64> through;
  TileLooks() { through.fill(kNotPassed); }
};

/// Of each cell of a tile the most looks through a square of passed cells that holds it.
/// \param spacing  of the rays, in cells
TileLooks sharedLooks(const KeyMap<TileLooks>& looks, std::int32_t ta, std::int32_t tb,
                      double spacing) {
  constexpr std::size_t kRow = 24;  // of the tile and those about it
  using Grid = std::array<int, kRow * kRow>;
  Grid own;
  own.fill(kNotPassed);
  for (std::int32_t b = 0; b < 3; ++b) {
    for (std::int32_t a = 0; a < 3; ++a) {
      const TileLooks* tile = looks.find(packKey(ta + a - 1, tb + b - 1));
      if (tile == nullptr) continue;
      for (std::size_t row = 0; row < 8; ++row) {
        std::copy_n(&tile->through[8 * row], 8, &own[kRow * (8 * b + row) + 8 * a]);
      }
    }
  }
  TileLooks shared;
  Grid most = own;
  const double wider = 1.0 + std::ceil(spacing);
  const double first = std::max(1.0 * kMinSide, std::min(1.0 * kMaxSide, wider));
  for (int side = static_cast<int>(first); side <= kMaxSide; ++side) {
    const auto n = static_cast<std::size_t>(side);
    Grid sums = own;
    for (const std::size_t step : {std::size_t{1}, kRow}) {  // of the square from each cell on, ...
      for (std::size_t i = 0; i + (n - 1) * step < sums.size(); ++i) {
        for (std::size_t k = 1; k < n; ++k) sums[i] += sums[i + k * step];
      }
    }
    for (const std::size_t step : {std::size_t{1}, kRow}) {  // ... of all that hold the cell
      for (std::size_t i = sums.size(); i-- > (n - 1) * step;) {
        for (std::size_t k = 1; k < n; ++k) sums[i] = std::max(sums[i], sums[i - k * step]);
      }
    }
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const int least = sums[i] > 0 && side > spacing ? kWideLook : 0;
      most[i] = std::max({most[i], least, sums[i]});
    }
  }
  for (std::size_t row = 0; row < 8; ++row) {
    std::copy_n(&most[kRow * (8 + row) + 8], 8, &shared.through[8 * row]);
  }
  return shared;
}

void missPlane(const MapData& map, Frame& frame, const MissTest& test, PlaneLayer& layer,
               const PlaneHits* hits, const KeyMap<std::uint64_t>& absorbed) {
  const double s = map.resolution();
  if (!test.reaches(layer.bounds(s, map.thickness()))) return;
  const Matrix3& r = test.image().inverseRotation();
  const Vector3 u = r * layer.frame().u;
  const Vector3 v = r * layer.frame().v;
  const Vector3 origin = test.image().toCamera(layer.frame().origin);
  const Vector3 normal = r * layer.frame().n;
  const Vector3 half_tile = 4.0 * s * (u.cwiseAbs() + v.cwiseAbs()) + Vector3::Constant(s);
  KeyMap<TileLooks> looks;
  const auto lookAt = [&](std::int32_t ta, std::int32_t tb, const RasterTile& tile) {
    // Most tiles of a large plane are far away or behind the camera.
    const double depth = origin.z() + (8 * ta + 4) * s * u.z() + (8 * tb + 4) * s * v.z();
    if (depth + half_tile.z() <= 0.0 || depth - half_tile.z() > map.missRange()) return;
    const Vector3 middle = origin + (8 * ta + 4) * s * u + (8 * tb + 4) * s * v;
    if (!test.mayBeMissed(middle, half_tile)) return;
    const TileHits* seen = hits != nullptr ? hits->tiles.find(packKey(ta, tb)) : nullptr;
    const std::uint64_t* others = absorbed.find(packKey(ta, tb));
    TileLooks own;
    for (std::uint64_t bits = tile.occupied() & ~(others != nullptr ? *others : 0); bits != 0;
         bits &= bits - 1) {
      const int bit = __builtin_ctzll(bits);
      const auto at = static_cast<std::size_t>(bit);
      if (seen != nullptr && seen->count[at] > 0) continue;
      const Vector3 centre =
          origin + (8 * ta + (bit & 7) + 0.5) * s * u + (8 * tb + (bit >> 3) + 0.5) * s * v;
      // A surface seen from behind cannot be seen at all.
      const double facing = -normal.dot(centre) / centre.norm();
      own.through[at] = test.looksThrough({centre, facing});
    }
    if (own.through != TileLooks().through) looks[packKey(ta, tb)] = own;
  };
  for (const RasterPatch& patch : layer.raster.patches()) {
    const TileWindow& w = patch.window;
    if (w.empty()) continue;
    const double columns = w.high_a - w.low_a + 1;
    const double rows = w.high_b - w.low_b + 1;
    const Vector3 middle =
        origin + (8 * w.low_a + 4.0 * columns) * s * u + (8 * w.low_b + 4.0 * rows) * s * v;
    const Vector3 half =
        4.0 * s * (columns * u.cwiseAbs() + rows * v.cwiseAbs()) + Vector3::Constant(1.01 * s);
    if (middle.z() + half.z() <= 0.0 || middle.z() - half.z() > map.missRange() ||
        !test.mayBeMissed(middle, half)) {
      continue;
    }
    layer.raster.forEachTile(patch, lookAt);
  }
  for (std::size_t i = 0; i < looks.size(); ++i) {
    std::int32_t ta = 0, tb = 0;
    unpackKey(looks.key(i), ta, tb);
    TileLooks through = looks.value(i);
    if (test.image().isSparse()) {
      const Vector3 middle = origin + (8 * ta + 4) * s * u + (8 * tb + 4) * s * v;
      const double facing = std::abs(normal.dot(middle)) / middle.norm();
      through = sharedLooks(looks, ta, tb, test.spacingAt(middle) / (s * facing));
    }
    RasterTile& tile = *layer.raster.find(ta, tb);
    bool changed = false;
    for (std::size_t bit = 0; bit < 64; ++bit) {
      if (through.through[bit] <= 0) continue;
      changed = true;
      frame.update.cells_removed += miss(map.params, tile, bit, through.through[bit]) ? 1 : 0;
    }
    if (changed) layer.raster.markDirty(ta, tb);
  }
}

void missCells(MapData& map, Frame& frame, const MissTest& test) {
  const double s = map.resolution();
  const auto frame_number = static_cast<std::uint32_t>(map.trajectory.size() - 1);
  const Vector3 half = test.image().extentInCamera(Vector3::Constant(2.0 * s));
  // One look that does not confirm it is enough for a cell of this belief.
  const std::uint8_t unproven = quantiseBelief(map.params.first_belief);
  const bool is_fragile =
      !isKept(afterMiss(unproven, map.params.miss_factor), map.params.min_probability);
  for (std::size_t r = 0; r < map.cells.regions.size(); ++r) {
    const Int3 region = unpackKey(map.cells.regions.key(r));
    const Vector3 low = s * (kRegionCells * Vector3(region.x, region.y, region.z) +
                             Vector3(map.cells.anchor.x, map.cells.anchor.y, map.cells.anchor.z));
    if (!test.reaches({low, low + Vector3::Constant(s * kRegionCells)})) continue;
    KeyMap<CellBlock>& blocks = map.cells.regions.value(r).blocks;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const std::uint64_t key = blocks.key(i);
      const Int3 at = unpackKey(key);
      CellBlock& block = blocks.value(i);
      if (block.occupied() == 0) continue;
      const Vector3 middle = (4.0 * s) * (Vector3(at.x, at.y, at.z) + Vector3::Constant(0.5));
      if (!test.mayBeMissed(test.image().toCamera(middle), half)) continue;
      std::uint64_t* seen = frame.cell_hits.find(key);
      std::uint64_t candidates = block.occupied() & ~(seen != nullptr ? *seen : 0);
      bool changed = false;
      for (; candidates != 0; candidates &= candidates - 1) {
        const int bit = __builtin_ctzll(candidates);
        const Int3 c = CellLayer::cellOf(at, bit);
        const Vector3 centre = s * (Vector3(c.x, c.y, c.z) + Vector3::Constant(0.5));
        const bool is_proven =
            !is_fragile || block.belief(static_cast<std::size_t>(bit)) > unproven;
        const int looks = test.looksThrough(
            {test.image().toCamera(centre), 1.0, kBehindErrors, false, is_proven});
        if (looks <= 0) continue;
        changed = true;
        if (seen == nullptr) seen = &frame.cell_hits[key];
        *seen |= std::uint64_t{1} << bit;
        frame.update.cells_removed +=
            miss(map.params, block, static_cast<std::size_t>(bit), looks) ? 1 : 0;
      }
      if (changed) map.cells.markDirty(at, frame_number);
    }
  }
}

}  // namespace

void integrateMisses(MapData& map, Frame& frame) {
  if (map.params.miss_factor >= 1.0) return;
  std::vector<const PlaneHits*> hits_of(map.planes.size(), nullptr);
  for (const PlaneHits& hits : frame.hits) hits_of[hits.layer] = &hits;
  frame.absorbed.resize(map.planes.size());
  for (const DepthImage& image : frame.images) {
    const MissTest test(map, frame, image);
    for (std::size_t l = 0; l < map.planes.size(); ++l) {
      missPlane(map, frame, test, map.planes[l], hits_of[l], frame.absorbed[l]);
    }
    missCells(map, frame, test);
  }
}

}  // namespace planar_mapping::detail
