// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/core/geometry/cuboid.h"
#include "planar_mapping/core/cuboids/cuboid_approximation.h"
#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/planes/multi_plane.h"
#include "planar_mapping/core/geometry/detail/plane_moments.h"
#include "planar_mapping/core/geometry/stereo_noise.h"
#include "planar_mapping/core/base/types.h"

namespace planar_mapping {

namespace detail {
struct MapAccess;
}

/// Pinhole model of an organized cloud: column = fx x / z + cx, row = fy y / z + cy (pixels).
struct PinholeCamera {
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  int width = 0;
  int height = 0;
};

/// Parameters of PlanarMap. Lengths in metres, angles in radians.
struct PLANAR_MAPPING_EXPORT PlanarMapParams {
  CuboidApproximationParams approximation;  ///< resolution s, profile, thickness, ...; up = world z
  double association_angle = 0.087;  ///< [ours] largest angle between a new plane and its map plane
  double association_offset = 0.10;  ///< [ours] largest offset between them at the new points
  double association_gap = 0.5;      ///< [ours] largest gap between their patches
  bool unknown_space = true;         ///< keep track of unknown space (METHOD: III-F, Fig. 5c)
  double unknown_resolution = 0.0;   ///< side of an unknown cell; 0 = resolution
  double max_range = 10.0;           ///< space beyond this depth is not judged
  double min_probability = 0.5;      ///< [ours] cells whose belief falls below this are removed
  double belief_gain = 0.5;  ///< [ours] share of the newest frame in a cell's belief, in (0, 1]
  double miss_factor = 0.7;  ///< [ours] belief is multiplied by it when looked through, in [0, 1]
  /// [ours] most belief a non-planar cell gets from one frame, and one that a frame with a known
  /// depth error adds to a plane there is, in (0, 1]; it is lost by one look that does not confirm
  /// it if miss_factor times it is below min_probability: even where some pixels measure nothing
  double first_belief = 0.7;
  /// [ours] points within so many depth errors of a plane's cells, along their ray, are its noise
  /// and make no cell, in [0, 10]; see FrameObservation::noise
  double noise_factor = 1.0;
  /// [ours] a cell is seen if it holds this share of the points it would have if it were full, in
  /// [0, 1]; where the camera is known. Cells of the first sight of a plane need only
  /// min_points_per_cell.
  double min_cell_share = 0.15;
  /// [ours] or, if that is less, the share of a strip of so many pixels along its edge and of the
  /// points that the depth error carries beyond half a cell; in [0, 1e6]
  double rim_pixels = 1.0;
  /// [ours] compact: a plane's cuboids reach so many root mean square distances of its points
  /// before and behind it, at most 0.45 (0.75 where that is five cells) and 0.75 of a cell, in
  /// [0, 10]; 0 = from the plane backwards
  double surface_factor = 3.0;
  /// [ours] cells follow a refit of their plane that moves them by more, in resolutions, >= 0
  double refit_tolerance = 0.1;
  /// [ours] radians between pixels of the images around the sensor, for clouds without a camera
  double range_image_step = 0.0087;

  /// The defaults of a profile: Paper takes beliefs as they are and adds nothing of ours.
  static PlanarMapParams of(Profile profile);

  /// \throws ParameterError
  void validate() const;
};

/// A plane of the map, world frame.
struct MapPlane {
  std::int32_t id = 0;  ///< never reused; Cuboid::plane_id refers to it
  Plane plane;
  PlaneMoments moments;
  std::uint32_t frames = 0;  ///< in how many frames it was seen
  double rms() const { return moments.fit().rms; }
};

/// What one frame brings to the map. Everything is in the sensor's frame but the pose.
struct FrameObservation {
  Pose T_world_sensor = Pose::Identity();
  double timestamp = 0.0;            ///< seconds
  PointsView points;                 ///< the whole cloud, as measured
  const Indices* indices = nullptr;  ///< the points to be mapped; null = all
  const Indices* ground = nullptr;   ///< removed ground: clears space, makes no cell
  const std::vector<PlaneSegment>* planes = nullptr;  ///< null = none
  const std::vector<float>* probability = nullptr;    ///< belief per point; null = 1
  /// Depth error of a stereo camera: widens what counts as one surface; absent = none.
  std::optional<StereoNoise> noise;
  /// Known intrinsics of an organized cloud; absent = estimated from it, else
  /// six images around the sensor are made of the points.
  std::optional<PinholeCamera> camera;
};

/// What an insertion did.
struct FrameUpdate {
  std::size_t planes_new = 0;
  std::size_t planes_matched = 0;
  std::size_t planes_merged = 0;  ///< planes of the map that turned out to be another one
  std::size_t cells_added = 0;
  std::size_t cells_removed = 0;
  std::size_t patches_rebuilt = 0;
  std::size_t absorbed_points = 0;
  std::size_t dropped_points = 0;  ///< not finite, beyond the world, or too few in their cell
};

/// The map of planar cuboids: planes with their patches, non-planar cells, unknown space
/// (the paper, III-F and IV).
///
/// World frame, z up, metres, up to 2^20 cells from the origin (100 km at 0.1 m); points beyond are
/// dropped and counted. Exactly one of isOccupied(), isFree() and isUnknown() holds anywhere.
///
/// Cuboids are derived when they are asked for, again only where the map changed. Over frames
/// - a plane is refitted from moments; its cells ride along with it and are never resampled;
/// - a cell's belief moves by belief_gain towards what the newest frame says, and is multiplied by
///   miss_factor when the sensor looks through it, or looks where it is and measures there without
///   a point in it; below min_probability the cell is gone;
/// - a plane seen again is the same plane; two that turn out to be one are merged, the older stays;
/// - a cell of space once seen free is never unknown again, in whatever order frames come. Cells
///   the rim of an image cuts are not judged, and pixels without a measurement say nothing.
/// For a static scene the order of frames changes nothing beyond the phase of the rasters.
///
/// The cost of insert() depends on the frame, but for a look at each plane's bounds. Copyable.
/// Const functions may be called from several threads at once; the first after an insert() builds
/// what queries need.
class PLANAR_MAPPING_EXPORT PlanarMap {
 public:
  explicit PlanarMap(const PlanarMapParams& params = PlanarMapParams());
  ~PlanarMap();
  PlanarMap(const PlanarMap& other);
  PlanarMap(PlanarMap&& other) noexcept;
  PlanarMap& operator=(const PlanarMap& other);
  PlanarMap& operator=(PlanarMap&& other) noexcept;

  const PlanarMapParams& params() const;

  /// The map without what only further frames need, for planners, simulators and narrow radio
  /// links: cuboids() and unknown space. It answers all queries as this map does, but that the
  /// probability of cuboids is 1, and takes a fraction of the bytes. Planes, cells, trajectory, seen
  /// free space and the parameters that say how frames are integrated are gone (params() has their
  /// defaults), and nothing can be added. A finished map gives itself.
  PlanarMap finished() const;
  bool isFinished() const;

  /// Associates the planes of the frame with those of the map, refits, extends patches, updates
  /// probabilities and unknown space, rebuilds the cuboids of what was touched.
  /// \throws InputError if indices or sizes do not fit the cloud,
  ///         if the pose is not finite,
  ///         or if the map is finished
  FrameUpdate insert(const FrameObservation& frame);
  /// Adds what another map knows, as if its frames had come after ours, but for what they would
  /// have seen through here. Its planes come with their rasters; those that lie on one of ours are
  /// joined with it. Cells of both have the larger belief. Space free in either is not unknown.
  /// Our parameters stay; frames() and trajectory() count its frames as well.
  /// \param T_map_other  from the world of the other to ours; where it is no motion by whole cells
  ///                     non-planar cells and space are resampled, cell by nearest cell
  /// \throws InputError if profile, resolution or thickness differ, the pose is no rigid motion, or
  ///         one of the maps is finished
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
  /// Unknown space as axis-aligned cuboids (state Unknown, plane_id -1), merged.
  std::vector<Cuboid> unknownCuboids() const;
  const std::vector<MapPlane>& planes() const;
  /// The sensor poses of the frames in order, with their time stamps.
  const std::vector<std::pair<double, Pose>>& trajectory() const;

  CellState stateAt(const Vector3& point) const;  ///< a point that is not finite is Unknown
  bool isOccupied(const Vector3& point) const { return stateAt(point) == CellState::Occupied; }
  bool isFree(const Vector3& point) const { return stateAt(point) == CellState::Free; }
  bool isUnknown(const Vector3& point) const { return stateAt(point) == CellState::Unknown; }
  /// Belief that the point is occupied: the cuboid's probability, 0 where free, 0.5 where unknown.
  double occupancyAt(const Vector3& point) const;
  /// Indices into cuboids() of those that contain the point (within margin, metres), ascending.
  Indices cuboidsAt(const Vector3& point, double margin = 0.0) const;

  std::size_t unknownCells() const;
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
  /// \throws Error naming what is wrong
  static PlanarMap deserialize(const std::uint8_t* data, std::size_t size);

 private:
  friend struct detail::MapAccess;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace planar_mapping
