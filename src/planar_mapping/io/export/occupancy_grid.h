// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::io {

/// The heights that a flat map looks at, metres.
struct GridBand {
  double low = 0.15;  ///< [ours] over the ground: below it is floor
  double high =
      1.8;  ///< [ours] over the ground: above it a robot passes under, and door frames are
  /// Height of the ground along the map's up axis; NaN = found: GroundHeights of
  /// PlanarMap::ground(); without that, of floors from the height of the level faces that most
  /// places the map was seen from are right above, of at least 4 square metres and eight times
  /// what is below; else of the lowest of at least 4 square metres, or of much larger ones above
  /// those, with next to nothing below them. Where there are none: 0 where the map starts at most 1
  /// m above or 0.35 m below it, else the lowest floor or lower end of a cuboid, but for the lowest
  /// hundredth of the occupied volume.
  double ground = std::numeric_limits<double>::quiet_NaN();
  double free_fraction = 0.75;  ///< [ours] of the band that a free cell needs: a robot has to fit
};

/// A map seen from above, as ROS has it (nav_msgs/OccupancyGrid).
struct OccupancyGrid {
  static constexpr std::int8_t kFree = 0;
  static constexpr std::int8_t kOccupied = 100;
  static constexpr std::int8_t kUnknown = -1;

  std::uint32_t width = 0;   ///< cells along x
  std::uint32_t height = 0;  ///< cells along y
  double cell = 0.1;         ///< side, metres
  /// Lower left corner of cell 0, in the axes of the map turned so that its up axis is z; a
  /// multiple of the cell.
  Vector2 origin = Vector2::Zero();
  /// Height the band counts from, metres; its median where the ground has heights of its own.
  double ground = 0.0;
  std::vector<std::int8_t> values;  ///< row by row, the row of smallest y first

  std::int8_t at(std::uint32_t x, std::uint32_t y) const {
    return values[std::size_t{y} * width + x];
  }
};

/// Height of the ground along \p up, a unit vector: what GridBand::ground finds, metres; 0 without
/// cuboids. \param sensors  where the map was seen from: a floor below one of these places and at
/// most 15 m beside it, at its height there, comes before those elsewhere
PLANAR_MAPPING_EXPORT double groundHeight(const std::vector<Cuboid>& cuboids, const Vector3& up,
                                          const std::vector<Vector3>& sensors = {});

/// How high the ground is at each place, along an up axis, metres. [ours]
class PLANAR_MAPPING_EXPORT GroundHeights {
 public:
  explicit GroundHeights(double everywhere) : GroundHeights({}, Vector3::UnitZ(), everywhere) {}
  /// \param ground  PlanarMap::ground(): where there are several over each other, the one of most
  ///                points counts; between them their mean by distance, elsewhere
  ///                the nearest
  /// \param up  a unit vector
  /// \param elsewhere  height where fewer than 2 places are known
  GroundHeights(const std::vector<GroundPoint>& ground, const Vector3& up, double elsewhere);

  double at(const Vector3& point) const;  ///< below or above a point
  double lowest() const { return lowest_; }
  double highest() const { return highest_; }
  double middle() const { return middle_; }  ///< median

 private:
  void spread();
  Vector2 placeOf(const Vector3& turned) const;

  Quaternion turn_;  ///< up to z
  double lowest_, highest_, middle_;
  double cell_ = 1.0;              ///< side in the raster, metres
  Vector2 low_ = Vector2::Zero();  ///< middle of its first cell, x and y once turned
  Eigen::Array2i size_ = {1, 1};
  std::vector<float> heights_;
};

/// What a grid is made of, in the axes of a map.
struct GridSource {
  std::vector<Cuboid> cuboids;      ///< occupied
  std::vector<Cuboid> space;        ///< free or, where unseen space is free, unknown
  Unseen unseen = Unseen::Unknown;  ///< what all else is
  Vector3 up = Vector3::UnitZ();    ///< a unit vector
  std::vector<GroundPoint> ground;  ///< PlanarMap::ground()
  std::vector<Vector3> sensors;     ///< of groundHeight()
};

/// A cell is occupied if a cuboid that is no floor meets the column over it within the band; else
/// free if enough of the column over its middle was seen free, but for drops: where there is no
/// face at the level of the cell and those around it and space was seen free one to three cells (of
/// at least 0.1 m) under it; beside five such cells together those without a face up to a metre
/// away, in the shadow of an edge; up to two cells beside any such cell also what has that space
/// under a face; and a cell around all; else unknown. Floor is what is level (by at most 11
/// degrees) and at most band.low over the ground, and faces that go on from there, rectangles at
/// most a cell apart, without a step of more than 0.12 m or band.low, where a robot 0.5 m across
/// has room; not what has free space right under it, as a table has.
/// \param cell  side, metres, above 0
/// \param obstacles  if given, a mark for each cuboid that makes a cell occupied
/// \throws ParameterError if cell or band are out of range, or there would be more than 50 million
///         cells
PLANAR_MAPPING_EXPORT OccupancyGrid occupancyGrid(const GridSource& source, double cell,
                                                  const GridBand& band,
                                                  std::vector<std::uint8_t>* obstacles = nullptr);

/// The same of a map. \param cell side, metres; 0 = the map's resolution
PLANAR_MAPPING_EXPORT OccupancyGrid occupancyGrid(const PlanarMap& map, double cell = 0.0,
                                                  const GridBand& band = GridBand());

}  // namespace planar_mapping::io
