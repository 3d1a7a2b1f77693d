// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "planar_mapping/cuboids/raster/plane_raster.h"
#include "planar_mapping/geometry/plane_moments.h"
#include "planar_mapping/map/store/tile_raster.h"

namespace planar_mapping::detail {

/// Points of one frame in a tile.
struct TileHits {
  std::array<std::uint32_t, 64> count{};
  std::array<float, 64> belief{};  ///< sum over the points
};

/// A plane of the map with the sparse raster of its occupied cells.
///
/// When the plane is refitted the frame follows it and the cells ride along with their indices:
/// nothing is resampled, so nothing smears; within the plane a cell moves by the square of the
/// small angle.
class PlaneLayer {
 public:
  std::int32_t id = 0;
  std::uint32_t frames = 0;  ///< in which it was seen
  TileRaster raster;

  const PlaneFrame& frame() const { return frame_; }
  const Plane& plane() const { return plane_; }
  const PlaneMoments& moments() const { return moments_; }
  /// Bumped whenever the frame moves.
  std::uint32_t frameRevision() const { return frame_revision_; }
  /// \param wanted  v is taken to be n x u
  void setFrame(const PlaneFrame& wanted);
  /// Takes the symmetric part of the scatter: as it is after it was saved and loaded.
  void setMoments(const PlaneMoments& moments);

  /// Makes the cell occupied if it is not yet.
  void setCell(std::int32_t a, std::int32_t b, std::uint8_t belief);
  /// Bounding cells, not tiles.
  TileWindow extent() const;
  /// World bounds of the cells with their thickness; empty if there are none.
  Eigen::AlignedBox3d bounds(double s, double thickness) const;
  /// Cell of a world point; false beyond the lattice.
  bool cellOf(const Vector3& point, double s, std::int32_t& a, std::int32_t& b) const;
  /// Follows the fit of the moments if that leaves the frame by more than \p tolerance (metres)
  /// anywhere on the raster. \return whether the frame moved
  bool refit(double s, double tolerance);

 private:
  PlaneFrame frame_;
  Plane plane_;
  PlaneMoments moments_;
  std::uint32_t frame_revision_ = 0;
};

}  // namespace planar_mapping::detail
