// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/map/planar_map.h"

// Where a robot can stand. Plans are in the axes of the map turned so that its up axis is z.
namespace planar_mapping {

/// The robot that a plan is made for. Metres, radians.
struct PLANAR_MAPPING_EXPORT RobotModel {
  static constexpr double kSteepest = 60.0 * kRadiansPerDegree;  ///< of any floor
  double height = 1.2;    ///< [ours] of free space that it needs over its floor, (0, 100]
  double radius = 0.25;   ///< [ours] of the floor around each place of the path that it stood on
  double max_step = 0.1;  ///< [ours] up or down that it climbs; lower things are no obstacle
  double max_slope = 15.0 * kRadiansPerDegree;  ///< [ours] of floors, [0, pi / 3]
  /// Of the sensor over the floor; NaN: any up to 2.5 m
  double camera_height = std::numeric_limits<double>::quiet_NaN();
  /// \throws ParameterError
  void validate() const;
};

/// A storey seen from above, as ROS has it (nav_msgs/OccupancyGrid).
struct PLANAR_MAPPING_EXPORT Plan {
  static constexpr std::int8_t kFree = 0;
  static constexpr std::int8_t kOccupied = 100;
  static constexpr std::int8_t kUnknown = -1;

  std::uint32_t width = 0;           ///< cells along x
  std::uint32_t height = 0;          ///< cells along y
  double cell = 0.1;                 ///< side, metres
  Vector2 origin = Vector2::Zero();  ///< lower left corner of cell 0; a multiple of the cell
  double floor = 0.0;                ///< median height of the floor that the robot reaches
  std::vector<std::int8_t> values;   ///< row by row, the row of smallest y first
  std::vector<float> heights;        ///< of the floor that the robot reaches; NaN elsewhere
  std::string note;                  ///< how much is free and, where it is little, what would help

  std::int8_t at(std::uint32_t x, std::uint32_t y) const {
    return values[std::size_t{y} * width + x];
  }
  /// Cell of a place; false outside.
  bool cellOf(double x, double y, std::uint32_t& column, std::uint32_t& row) const {
    const double cx = (x - origin.x()) / cell, cy = (y - origin.y()) / cell;
    if (!(cx >= 0.0 && cy >= 0.0 && cx < width && cy < height)) return false;
    column = static_cast<std::uint32_t>(cx);
    row = static_cast<std::uint32_t>(cy);
    return true;
  }
  /// Is the place free?
  bool isStandable(double x, double y) const {
    std::uint32_t column = 0, row = 0;
    return cellOf(x, y, column, row) && at(column, row) == kFree;
  }
  double freeFraction() const;  ///< of the cells that are free or occupied; 0 without any
  /// Metres from the middle of each cell to that of the nearest occupied cell, infinite without
  /// one, row by row. Exact (Felzenszwalb and Huttenlocher, 2012).
  std::vector<float> distances() const;
};

/// The cells of a plane in which points were measured: (a, b) spans [a, a + 1) times the side along
/// u and [b, b + 1) along v.
struct MeasuredCells {
  Vector3 origin, u, v, n;
  std::vector<std::pair<std::int32_t, std::int32_t>> cells;
};

/// What plans are made of, in the axes of a map.
struct PLANAR_MAPPING_EXPORT PlanSource {
  std::vector<Cuboid> occupied;
  std::vector<Cuboid> space;        ///< free or, where unseen space is free, unknown
  Unseen unseen = Unseen::Unknown;  ///< what all else is
  bool knows_sides = true;          ///< normals of planes point to where they were seen from
  Vector3 up = Vector3::UnitZ();
  std::vector<GroundPoint> ground;    ///< PlanarMap::ground()
  std::vector<Vector3> path;          ///< places of the sensor
  std::vector<MapPlane> planes;       ///< none: planes lie in the middle of their cuboids
  std::vector<MeasuredCells> floors;  ///< of planes that may be floors; cuboids bridge small gaps
  double resolution = 0.1;            ///< of the map, metres

  void turn(const Quaternion& turn);  ///< into axes that are turned, all of it
};
/// Of planes that are no steeper than any robot climbs; none in a finished map.
PLANAR_MAPPING_EXPORT std::vector<MeasuredCells> measuredFloors(const PlanarMap& map);
PLANAR_MAPPING_EXPORT PlanSource planSourceOf(const PlanarMap& map);

/// The storeys of a map, the lowest first; at least one.
///
/// A place is standable where a floor was measured (points in its own cell of a plane and in those
/// around it, at most max_slope steep), the robot gets there from where it was without a step of
/// more than max_step, and space up to its height was seen free. It is occupied where something
/// stands in that height, or where the floor beside it drops by more than max_step; else unknown,
/// also at the rim of the floor that was measured and on removed ground, which is known by squares
/// of 2 m only. Places of the path count as seen, with the robot's radius, where the height of the
/// sensor over the nearest floor is possible. Without a path the robot is taken to stand on the
/// largest floor of 4 m2 or more. Storeys are floors over each other, a robot's height apart or
/// more. \param cell side, metres; 0 = the resolution of the map \throws ParameterError if cell or
/// robot are out of range, or there would be too many cells
PLANAR_MAPPING_EXPORT std::vector<Plan> plansOf(PlanSource source, const RobotModel& robot,
                                                double cell = 0.0);
PLANAR_MAPPING_EXPORT std::vector<Plan> plansOf(const PlanarMap& map,
                                                const RobotModel& robot = RobotModel(),
                                                double cell = 0.0);
/// The highest storey whose floor is below a height along up, else the lowest. \param plans of
/// plansOf()
PLANAR_MAPPING_EXPORT const Plan& storeyBelow(const std::vector<Plan>& plans, double height);
/// The storey around a place where the robot's sensor is now, in the axes of the map: within so
/// many metres along x and y, from what the map holds there and up to 10 m above and below.
PLANAR_MAPPING_EXPORT Plan planAround(const PlanarMap& map, const Vector3& sensor, double reach,
                                      const RobotModel& robot = RobotModel(), double cell = 0.0);

/// Height along \p up of the floor of most area among the level faces below the sensor of middle
/// height and within 10 m of it, among all without sensors; of the lowest cuboid where there is no
/// level face, 0 without cuboids.
PLANAR_MAPPING_EXPORT double floorHeight(const std::vector<Cuboid>& cuboids, const Vector3& up,
                                         const std::vector<Vector3>& sensors = {});

}  // namespace planar_mapping
