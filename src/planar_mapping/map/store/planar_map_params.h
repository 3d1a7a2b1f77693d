// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "planar_mapping/base/export.h"
#include "planar_mapping/cuboids/cuboid_approximation.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/geometry/cloud_scale.h"

namespace planar_mapping {

/// What space is that no measurement ever passed and no cuboid occupies.
enum class Unseen : std::uint8_t {
  Unknown,  ///< unknown: only what was seen free is free
  Free      ///< the paper's reading (III-F): free, but for what lies behind what was measured
};

/// Whose coordinates a map has.
enum class MapFrame : std::uint8_t {
  World,  ///< those of the poses, or of the cloud, that were given
  Start   ///< of its own: poses were found from the first frame on, which stood at the start
};

/// Parameters of PlanarMap. Lengths in metres, angles in radians.
struct PLANAR_MAPPING_EXPORT PlanarMapParams {
  /// Where the map's frame is in the world the input came in, metres (e.g. UTM): world coordinates
  /// are those of the map plus this. The map itself does not use it, it is kept in its file.
  Vector3 origin = Vector3::Zero();
  /// Maps of frames of their own do not fit together as they are. Not used by the map either.
  MapFrame frame = MapFrame::World;
  CuboidApproximationParams approximation;  ///< resolution s, profile, thickness, ...; up = world z
  /// [ours] largest angle between a new plane and its map plane, 0.087; the degrees are those of
  /// configurations, to the last bit
  double association_angle = 4.98473281764 * kRadiansPerDegree;
  double association_offset = 0.10;  ///< [ours] largest offset between them at the new points
  double association_gap = 0.5;      ///< [ours] largest gap between their patches
  bool unknown_space = true;         ///< keep track of free and unknown space (III-F, Fig. 5c)
  Unseen unseen = Unseen::Unknown;   ///< [ours] what space is that was never observed
  double unknown_resolution = 0.0;   ///< side of a cell of free or unknown space; 0 = resolution
  /// Depth up to which frames say what space is; 0 = as far as the sensor measures, at most 2,048
  /// cells
  double max_range = 0.0;
  /// [ours] depth up to which occupied cells lose belief by miss_factor; 0 = max_range
  double miss_range = 0.0;
  double min_probability = 0.5;  ///< [ours] cells whose belief falls below this are removed
  double belief_gain = 0.5;  ///< [ours] fraction of the newest frame in a cell's belief, in (0, 1]
  double miss_factor = 0.7;  ///< [ours] belief is multiplied by it when looked through, in [0, 1]
  /// [ours] most belief a non-planar cell gets from one frame, and one that a frame with a known
  /// depth error adds to a plane there is, in (0, 1]; it is lost by one look that does not confirm
  /// it if miss_factor times it is below min_probability: even where some pixels measure nothing
  double first_belief = 0.7;
  /// [ours] points within so many depth errors of a plane's cells, along their ray, are its noise
  /// and make no cell, in [0, 10]; see FrameObservation::noise
  double noise_factor = 1.0;
  /// [ours] a cell is seen if it holds this fraction of the points it would have if it were full,
  /// in [0, 1]; where the camera is known, and in scans after the first. Cells of the first sight
  /// of a plane need only min_points_per_cell.
  double min_cell_fraction = 0.15;
  /// [ours] or, if that is less, the fraction of a strip of so many pixels along its edge and of
  /// the points that the depth error carries beyond half a cell; in [0, 1e6]
  double rim_pixels = 1.0;
  /// [ours] compact: a plane's cuboids reach so many root mean square distances of its points
  /// before and behind it, at most 0.45 (0.75 where that is five cells) and 0.75 of a cell, in
  /// [0, 10]; 0 = from the plane backwards
  double surface_factor = 3.0;
  /// [ours] cells follow a refit of their plane that moves them by more, in resolutions, >= 0
  double refit_tolerance = 0.1;
  /// [ours] radians between pixels of the images around the sensor, for clouds without a camera
  double range_image_step = 0.498473281764 * kRadiansPerDegree;

  /// Sets approximation.resolution, and the limits of association that suit it: one cell for the
  /// offset, five for the gap.
  void setResolution(double metres);

  /// These parameters for a map that begins with such a cloud, as the stage
  /// `planar_cuboid_approximation` has them: ranges that are 0 follow from the cloud, none is
  /// longer than 2,048 cells, up has length 1, and without a sensor no space is known to be free.
  /// \throws InputError if the cloud's coordinates, as floats, are too coarse for the resolution
  PlanarMapParams resolvedFor(const CloudScale& scale) const;

  /// The defaults of a profile: Paper takes beliefs as they are and adds nothing of ours.
  static PlanarMapParams of(Profile profile);

  /// \throws ParameterError
  void validate() const;
};

/// [ours] Origin of a map of a place whose coordinates are too large for cells: the place to a
/// kilometre along each axis where it is farther than 10 km, else 0.
PLANAR_MAPPING_EXPORT Vector3 originNear(const Vector3& place);

}  // namespace planar_mapping
