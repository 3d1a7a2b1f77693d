// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/cuboid.h"
#include "planar_mapping/geometry/plane_moments.h"
#include "planar_mapping/map/sensor/frame_observation.h"
#include "planar_mapping/map/store/planar_map_params.h"

namespace planar_mapping {

namespace detail {
struct MapAccess;
}

/// A plane of the map, world frame.
struct MapPlane {
  std::int32_t id = 0;  ///< never reused; Cuboid::plane_id refers to it
  Plane plane;
  PlaneMoments moments;
  std::uint32_t frames = 0;  ///< in how many frames it was seen
  double rms() const { return moments.fit().rms; }
};

/// Where ground was that was removed from frames: the middle of a cube of 2 m, in the mean height
/// of some of its points, metres.
struct GroundPoint {
  Vector3 position = Vector3::Zero();
  std::uint32_t points = 0;  ///< at most 65535
};

/// The map of planar cuboids: planes with their patches, non-planar cells, unknown space
/// (the paper, III-F and IV).
///
/// World frame, z up, metres, up to 2^20 cells from the origin (100 km at 0.1 m); points beyond are
/// dropped and counted. Exactly one of isOccupied(), isFree() and isUnknown() holds anywhere.
///
/// Cuboids are derived when they are asked for, again only where the map changed. Nothing is
/// rounded: planes and poses keep double precision, also in the file. Over frames
/// - a plane is refitted from moments; its cells ride along with it and are never resampled;
/// - a cell's belief moves by belief_gain towards what the newest frame says, and is multiplied by
///   miss_factor when the sensor looks through it, or looks where it is and measures there without
///   a point in it; below min_probability the cell is gone;
/// - a plane seen again is the same plane; two that turn out to be one are merged, the older stays;
/// - a cell of space once seen free is never unknown again, in whatever order frames come. Cells
///   the rim of an image cuts are left as they are, and pixels without a measurement say nothing.
/// For a static scene the order of frames changes nothing beyond the phase of the rasters.
///
/// The cost of insert() depends on the frame, but for a look at each plane's bounds. Copyable.
/// Const functions may be called from several threads at once; the first after an insert() builds
/// what queries need.
class PLANAR_MAPPING_EXPORT PlanarMap {
 public:
  /// Cells from the origin, along each axis, beyond which points are dropped.
  static constexpr std::int32_t kReach = 1 << 20;

  explicit PlanarMap(const PlanarMapParams& params = PlanarMapParams());
  ~PlanarMap();
  PlanarMap(const PlanarMap& other);
  PlanarMap(PlanarMap&& other) noexcept;
  PlanarMap& operator=(const PlanarMap& other);
  PlanarMap& operator=(PlanarMap&& other) noexcept;

  const PlanarMapParams& params() const;

  /// The map without what only further frames need, for planners, simulators and narrow radio
  /// links: cuboids() and unknown space. It answers all queries as this map does, but that the
  /// probability of cuboids is 1, and takes a fraction of the bytes. Planes, cells, trajectory,
  /// seen free space and the parameters that say how frames are integrated are gone (params() has
  /// their defaults), and nothing can be added. A finished map gives itself.
  PlanarMap finished() const;
  bool isFinished() const;

  /// Associates the planes of the frame with those of the map, refits, extends patches, updates
  /// probabilities and unknown space, rebuilds the cuboids of what was touched.
  /// \throws InputError if indices or sizes do not fit the cloud,
  ///         if the pose is not finite,
  ///         or if the map is finished
  FrameUpdate insert(const FrameObservation& frame);
  /// Adds what another map knows. Its planes join ours as those of a frame do, log odds of cells of
  /// both are added, space free in either is free. Our parameters stay. The map that began first is
  /// the earlier one: what only it has and the later one saw free is gone; in one world a.merge(b)
  /// and b.merge(a) know the same, bit for bit, and a.merge(a) changes nothing.
  /// \param T_map_other  from the world of the other to ours; where it is no motion by whole cells
  ///                     non-planar cells and space are resampled, cell by nearest cell
  /// \throws InputError if profile, resolution or thickness differ, up axes by more than 10 degrees
  ///         where the pose puts them, the pose is no rigid motion, one of the maps is finished,
  ///         the other would lie beyond kReach cells, or space of more than 2^14 regions of 32 x 32
  ///         x 32 cells would have to be resampled; the map is then as before
  FrameUpdate merge(const PlanarMap& other, const Pose& T_map_other = Pose::Identity());
  /// Forgets everything but the parameters. \throws InputError if the map is finished
  void clear();

  /// Occupied cuboids: planes' own by plane id, then boxes; those on a plane have its id as well.
  const std::vector<Cuboid>& cuboids() const;
  /// Number of cuboids(), without making their list.
  std::size_t cuboidCount() const;
  /// No less than cuboidCount(), to watch a map while it grows: only what has not changed since the
  /// last question is covered as cuboids() has it, the rest by a quicker search, so that the answer
  /// takes a fraction of the time and depends on when it was asked.
  std::size_t cuboidCountAtMost() const;
  /// Cubes of 64 x 64 x 64 cells with so much clutter that boxes are laid over it without a search
  /// for fewer of them (profile Compact); 0 in a finished map.
  std::size_t clutteredRegions() const;
  /// Unknown space as axis-aligned cuboids (state Unknown, plane_id -1), merged. With
  /// Unseen::Unknown, where it has no end, the part within bounds().
  std::vector<Cuboid> unknownCuboids() const;
  /// Free or unknown space (state) as unknownCuboids(): the cells with their centres in a box,
  /// metres; what no frame saw anything of within 32 cells or more is not listed.
  /// \throws ParameterError if state is Occupied
  std::vector<Cuboid> spaceCuboids(CellState state, const Vector3& low, const Vector3& high) const;
  /// All space that a measurement passed: spaceCuboids() of state Free without a box.
  std::vector<Cuboid> freeCuboids() const;
  const std::vector<MapPlane>& planes() const;
  /// The sensor poses of the frames in order, with their time stamps.
  const std::vector<std::pair<double, Pose>>& trajectory() const;
  /// Places on the ground that was removed from frames (FrameObservation::ground), which has no
  /// cuboids: a place in each cube of 2 m; none in a finished map. [ours]
  std::vector<GroundPoint> ground() const;

  CellState stateAt(const Vector3& point) const;  ///< a point that is not finite is Unknown
  bool isOccupied(const Vector3& point) const { return stateAt(point) == CellState::Occupied; }
  bool isFree(const Vector3& point) const { return stateAt(point) == CellState::Free; }
  bool isUnknown(const Vector3& point) const { return stateAt(point) == CellState::Unknown; }
  /// Belief that the point is occupied: the cuboid's probability, 0 where free, 0.5 where unknown.
  double occupancyAt(const Vector3& point) const;
  /// Indices into cuboids() of those that contain the point (within margin, metres), ascending.
  Indices cuboidsAt(const Vector3& point, double margin = 0.0) const;

  std::size_t unknownCells() const;  ///< those of unknownCuboids()
  std::size_t frames() const;
  bool empty() const;
  /// Axis-aligned bounds of the occupied cuboids; false if there are none.
  bool bounds(Vector3& low, Vector3& high) const;
  /// Bytes of the live structure, counted.
  std::size_t memoryBytes() const;

  /// The bytes of a .pmap file (docs/file_format.md), also of a finished map; the same map always
  /// gives the same bytes. They hold cuboids(), which are derived first.
  std::vector<std::uint8_t> serialize() const;
  /// Reads what serialize() gave. Of \p size bytes at most 1 MiB + 256 size are unpacked.
  /// \param threads  of the map's parameters, which no file holds: used by all that it derives, as
  ///                 its cuboids at the first question; 0 = all cores. Results do not depend on it.
  /// \throws Error naming what is wrong; ParameterError if threads is
  static PlanarMap deserialize(const std::uint8_t* data, std::size_t size, int threads = 1);

 private:
  friend struct detail::MapAccess;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace planar_mapping
