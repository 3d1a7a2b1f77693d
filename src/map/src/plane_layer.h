// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "cell_values.h"
#include "key_map.h"
#include "planar_mapping/map/planar_map.h"
#include "stored_plane.h"

namespace planar_mapping::detail {

/// 8 x 8 cells of a plane's raster.
class RasterTile {
 public:
  std::uint64_t occupied() const { return occupied_; }  ///< bit 8 b + a
  /// Of an occupied cell.
  std::uint8_t belief(std::size_t bit) const { return beliefs_.get(occupied_, bit); }
  /// Makes the cell occupied if it is not yet.
  void setBelief(std::size_t bit, std::uint8_t belief) {
    const std::uint64_t flag = std::uint64_t{1} << bit;
    if ((occupied_ & flag) != 0) return beliefs_.set(occupied_, bit, belief);
    beliefs_.insert(occupied_, bit, belief);
    occupied_ |= flag;
  }
  /// Of an occupied cell.
  void remove(std::size_t bit) {
    beliefs_.remove(occupied_, bit);
    occupied_ &= ~(std::uint64_t{1} << bit);
  }
  std::size_t memoryBytes() const { return beliefs_.memoryBytes(); }  ///< beside the tile itself

 private:
  std::uint64_t occupied_ = 0;
  BeliefValues beliefs_;
};

/// A tile and its coordinates.
struct PlacedTile {
  std::int32_t a = 0;
  std::int32_t b = 0;
  const RasterTile* tile = nullptr;
};

/// Points of one frame in a tile.
struct TileHits {
  std::array<std::uint32_t, 64> count{};
  std::array<float, 64> belief{};  ///< sum over the points
};

/// A block of kPatchCells x kPatchCells cells: the unit in which cuboids are made, so that the cost
/// of a frame does not grow with the plane. Patches start at the middle of what was seen first, and
/// what one frame sees of a plane rarely reaches beyond one.
struct PlanePatch {
  std::uint32_t revision = 0;  ///< number of frames in the map when it changed last
  bool dirty = true;           ///< changed since
  // Tiles that hold a cell lie in [low, high], which is tight after tidy().
  std::int32_t low_tile_a = kLatticeLimit;
  std::int32_t low_tile_b = kLatticeLimit;
  std::int32_t high_tile_a = -kLatticeLimit;
  std::int32_t high_tile_b = -kLatticeLimit;

  void include(std::int32_t tile_a, std::int32_t tile_b) {
    low_tile_a = std::min(low_tile_a, tile_a);
    low_tile_b = std::min(low_tile_b, tile_b);
    high_tile_a = std::max(high_tile_a, tile_a);
    high_tile_b = std::max(high_tile_b, tile_b);
  }
};
constexpr std::int32_t kPatchCells = 128;

/// Sparse raster of the occupied cells of one plane.
///
/// Cell (a, b) spans [a s, (a + 1) s) x [b s, (b + 1) s) along u and v of the frame. When the plane
/// is refitted the frame follows it and the cells ride along with their indices: nothing is
/// resampled, so nothing smears; within the plane a cell moves by the square of the small angle.
class PlaneLayer {
 public:
  std::int32_t id = 0;
  std::uint32_t frames = 0;  ///< in which it was seen
  StoredPlane stored;        ///< frame and moments as of the last settle()
  /// Another number for another settled frame.
  std::uint32_t frame_revision = 0;
  std::int32_t anchor_a = 0;  ///< first cell of patch (0, 0); multiples of 8
  std::int32_t anchor_b = 0;
  KeyMap<RasterTile> tiles;  ///< by (a >> 3, b >> 3)
  KeyMap<PlanePatch> patches;

  /// Makes frame(), plane() and moments() ready. They are large and follow from `stored`: a map
  /// has them only while it takes a frame in, and moments only of the planes that are near it.
  void wake();
  const PlaneFrame& frame() const { return fit_->frame; }
  const Plane& plane() const { return fit_->plane; }
  const PlaneMoments& moments() const;
  /// Sets frame() and plane(), until the next settle().
  void setFrame(const PlaneFrame& wanted);
  void setMoments(const PlaneMoments& moments);
  /// Rounds frame and moments as the file does, if they changed, and forgets what wake() made.
  void settle();
  /// Frame and moments of a file.
  void restore(const StoredPlane& plane);
  /// The tile, which is added if it is new.
  RasterTile& tileAt(std::int32_t tile_a, std::int32_t tile_b);
  bool at(std::int32_t a, std::int32_t b) const;
  /// Is a cell occupied whose index differs by at most radius in a and in b?
  bool anyWithin(std::int32_t a, std::int32_t b, std::int32_t radius) const;
  /// Bounding cells [low_a, high_a] x [low_b, high_b] of the tiles; false if there are none.
  bool extent(std::int32_t& low_a, std::int32_t& low_b, std::int32_t& high_a,
              std::int32_t& high_b) const;
  /// World bounds of the cells with their thickness; false if there are none.
  bool bounds(double s, double thickness, Vector3& low, Vector3& high) const;
  /// Cell of a world point; false beyond the lattice.
  bool cellOf(const Vector3& point, double s, std::int32_t& a, std::int32_t& b) const;

  void setCell(std::int32_t a, std::int32_t b, std::uint8_t belief);
  void markDirty(std::int32_t tile_a, std::int32_t tile_b);
  std::uint64_t patchKey(std::int32_t tile_a, std::int32_t tile_b) const;
  /// Stamps the dirty patches and forgets empty ones. \return how many were dirty
  std::size_t tidy(std::uint32_t revision);
  /// The tiles with cells of each of the patches, which are given by their positions.
  std::vector<std::vector<PlacedTile>> tilesOf(const std::vector<std::size_t>& positions) const;
  /// Follows the fit of the moments if that leaves the frame by more than \p tolerance (metres)
  /// anywhere on the raster. \return whether the frame moved
  bool refit(double s, double tolerance);
  std::size_t memoryBytes() const;  ///< beside the layer itself

 private:
  struct Fit {
    PlaneFrame frame;
    Plane plane;
    std::optional<PlaneMoments> moments;  ///< unless they are those that are stored
  };
  /// Copies wake up on their own.
  struct WorkingFit : std::unique_ptr<Fit> {
    WorkingFit() = default;
    WorkingFit(const WorkingFit&) : std::unique_ptr<Fit>() {}
    WorkingFit(WorkingFit&&) noexcept = default;
    WorkingFit& operator=(const WorkingFit&) {
      reset();
      return *this;
    }
    WorkingFit& operator=(WorkingFit&&) noexcept = default;
  };
  Fit& fit() {
    wake();
    return *fit_;
  }

  WorkingFit fit_;
  bool settled_ = true;
  // Tiles [low, high]; grows as tiles are added and is exact after tidy().
  std::int32_t low_tile_a_ = kLatticeLimit;
  std::int32_t low_tile_b_ = kLatticeLimit;
  std::int32_t high_tile_a_ = -kLatticeLimit;
  std::int32_t high_tile_b_ = -kLatticeLimit;
};

}  // namespace planar_mapping::detail
