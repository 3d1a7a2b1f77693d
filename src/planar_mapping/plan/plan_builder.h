// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "planar_mapping/plan/floor_levels.h"

namespace planar_mapping::detail {

/// Smallest floor of a room: smaller level faces are furniture, square metres.
constexpr double kMinFloor = 4.0;

/// Part of the vertical line through a place that is in a cuboid, grown along x and y.
bool spanOf(const Cuboid& cuboid, const Matrix3& to_local, const Vector2& at, double grow,
            double& low, double& high);

/// Finds what is standable of a map, step by step: floors, path, space, reach, edges, storeys.
class PlanBuilder {
 public:
  /// \param cell 0 = the resolution of the map
  PlanBuilder(PlanSource source, const RobotModel& robot, double cell);
  std::vector<Plan> plans();

 private:
  /// What is known of a level beside its place.
  struct State {
    bool is_blocked = false;  ///< something stands in the robot's height
    bool is_seen = false;     ///< free up to the robot's height
    bool is_hollow = false;   ///< space below the floor was seen free
    bool is_reached = false;  ///< without a step
    bool is_edge = false;     ///< beside a drop
    bool is_rim = false;      ///< beside what was not measured
    bool isStandable() const { return is_reached && is_seen && !is_blocked && !is_edge && !is_rim; }
  };
  void placeRaster();
  void addFaces();
  void addMeasured();
  void addGround();
  /// Joins levels without headroom between them; the highest counts.
  void sortLevels();
  void markParts();
  void addPath();
  void addDisc(const Vector2& place, const Vector2& next, const FloorLevel& floor);
  std::optional<std::uint32_t> floorUnder(const Vector3& sensor) const;
  void stackObstacles();
  void lookAbove();
  void reach();
  void findEdges();
  std::vector<double> storeyHeights() const;
  Plan planOf(const std::vector<double>& storeys, std::size_t storey) const;
  std::string noteOf(const Plan& plan, const std::vector<std::uint32_t>& levels) const;

  bool isBlocked(std::size_t cell, double floor) const;
  /// Was space of a thickness, a step below a floor, seen free?
  bool isHollow(std::size_t cell, double floor, double thickness) const;
  /// The level at a cell that is no step away from a height, if there is one.
  std::optional<std::uint32_t> levelNear(std::size_t cell, double height, double tolerance) const;
  /// Calls visit(cell, squared distance in cells) for the cells around one.
  template <typename Visit>
  void forNeighbours(std::size_t cell, int reach, const Visit& visit) const;

  PlanSource source_;  ///< z up
  RobotModel robot_;
  PlanRaster raster_;
  CellLists<FloorLevel>::Found found_;
  CellLists<FloorLevel> levels_;
  std::vector<std::uint32_t> cell_of_;  ///< of each level
  std::vector<double> part_area_;       ///< of the connected floor of each level, square metres
  std::vector<std::uint32_t> seeds_;    ///< levels below the path
  std::vector<State> states_;
  CellLists<Interval> obstacles_;
  std::optional<FreeColumns> free_;
};

}  // namespace planar_mapping::detail
