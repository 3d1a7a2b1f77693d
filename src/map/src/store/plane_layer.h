// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "store/open_raster.h"
#include "store/packed_records.h"
#include "planar_mapping/map/planar_map.h"
#include "store/stored_plane.h"

namespace planar_mapping::detail {

/// Points of one frame in a tile.
struct TileHits {
  std::array<std::uint32_t, 64> count{};
  std::array<float, 64> belief{};  ///< sum over the points
};

/// What a map knows of a plane beside its cells.
struct PlaneState {
  std::uint32_t frames = 0;          ///< in which it was seen
  std::uint32_t frame_revision = 0;  ///< another number for another settled frame
  StoredPlane stored;                ///< frame and moments as the file keeps them
};

/// A plane of the map that is open to be looked at or worked on: its state and the sparse raster of
/// its occupied cells. Between frames a plane is at rest, see RestingPlanes.
///
/// When the plane is refitted the frame follows it and the cells ride along with their indices:
/// nothing is resampled, so nothing smears; within the plane a cell moves by the square of the
/// small angle.
class PlaneLayer {
 public:
  std::int32_t id = 0;

  PlaneLayer() = default;
  /// From what pack() wrote, which must outlive this.
  explicit PlaneLayer(const std::uint8_t* packed);
  /// Rounds frame and moments as the file does, if they changed. \return whether anything of the
  /// plane or its patches did
  bool settle();
  /// Writes the plane, which is settled; patches that changed are stamped with \p revision, those
  /// without a cell left out. \return whether there is a cell
  bool pack(std::uint32_t revision, PackWriter& out) const;

  const PlaneState& state() const { return state_; }
  /// Makes frame() and plane() ready.
  void wake();
  const PlaneFrame& frame() const { return frame_; }
  const Plane& plane() const { return plane_; }
  const PlaneMoments& moments() const;
  double weight() const { return state_.stored.weight.value(); }  ///< before this frame
  void setFrame(const PlaneFrame& wanted);
  void setMoments(const PlaneMoments& moments);
  void setFrames(std::uint32_t frames);
  /// Frame and moments of a file.
  void restore(const StoredPlane& plane);

  OpenRaster& raster() { return raster_; }
  const OpenRaster& raster() const { return raster_; }
  /// Makes the cell occupied if it is not yet.
  void setCell(std::int32_t a, std::int32_t b, std::uint8_t belief);
  /// Bounding cells [low_a, high_a] x [low_b, high_b] of the tiles; false if there are none.
  bool extent(std::int32_t& low_a, std::int32_t& low_b, std::int32_t& high_a,
              std::int32_t& high_b) const;
  /// World bounds of the cells with their thickness; false if there are none.
  bool bounds(double s, double thickness, Vector3& low, Vector3& high) const;
  /// Cell of a world point; false beyond the lattice.
  bool cellOf(const Vector3& point, double s, std::int32_t& a, std::int32_t& b) const;
  /// Follows the fit of the moments if that leaves the frame by more than \p tolerance (metres)
  /// anywhere on the raster. \return whether the frame moved
  bool refit(double s, double tolerance);

 private:
  void store(const StoredPlane& plane);

  PlaneState state_;
  OpenRaster raster_;
  PlaneFrame frame_;
  Plane plane_;
  mutable std::optional<PlaneMoments> moments_;  ///< unless they are those that are stored
  bool settled_ = true;                          ///< frame and moments are those that are stored
  bool changed_ = true;                          ///< beside the patches; new planes have
};

/// The planes of a map between frames, in few bytes.
class RestingPlanes {
 public:
  /// To be looked at, by one thread each, or worked on while nothing changes here. By id.
  std::vector<PlaneLayer> open() const;
  /// Takes back what open() gave, changed or not, with new ones behind and without what is gone;
  /// forgets planes without a cell. \return how many patches were dirty
  std::size_t close(std::vector<PlaneLayer> planes, std::uint32_t revision);
  /// Makes \p count planes, one after the other, with make(i).
  template <typename Make>
  void assign(std::size_t count, std::uint32_t revision, Make&& make);
  std::size_t memoryBytes() const { return records_.memoryBytes(); }

 private:
  PackedRecords records_;
};

template <typename Make>
void RestingPlanes::assign(std::size_t count, std::uint32_t revision, Make&& make) {
  const std::vector<PackedRecords::Record> none;
  PackedRecords::Change change(none);
  for (std::size_t i = 0; i < count; ++i) {
    PlaneLayer layer = make(i);
    layer.settle();
    PackWriter out;
    if (layer.pack(revision, out)) change.put(out.bytes);
  }
  records_.apply(change);
}

}  // namespace planar_mapping::detail
