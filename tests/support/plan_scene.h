// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <deque>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/plan/plan.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping::test {

/// A block whose top may rise along x.
struct Solid {
  Vector3 low, high;
  double rise = 0.0;  ///< of the top, per metre along x from low.x

  double topAt(double x) const { return high.z() + rise * (x - low.x()); }
  bool covers(double x, double y) const {
    return x >= low.x() && x <= high.x() && y >= low.y() && y <= high.y();
  }
  /// Distance at which a ray enters it, infinite if it does not.
  double entry(const Vector3& from, const Vector3& along) const {
    double enter = 0.0, leave = INFINITY;
    const auto clip = [&](const Vector3& n, double limit) {  // keeps n . p <= limit
      const double rate = n.dot(along), room = limit - n.dot(from);
      if (rate > 0.0) {
        leave = std::min(leave, room / rate);
      } else if (rate < 0.0) {
        enter = std::max(enter, room / rate);
      } else if (room < 0.0) {
        leave = -1.0;
      }
    };
    clip({-1, 0, 0}, -low.x());
    clip({1, 0, 0}, high.x());
    clip({0, -1, 0}, -low.y());
    clip({0, 1, 0}, high.y());
    clip({0, 0, -1}, -low.z());
    clip({-rise, 0, 1}, high.z() - rise * low.x());
    return enter < leave && enter > 0.0 ? enter : INFINITY;
  }
};

/// All cells of a level floor in the middle of a box.
inline MeasuredCells measured(const Vector3& low, const Vector3& high, double side) {
  MeasuredCells floor{{low.x(), low.y(), 0.5 * (low.z() + high.z())},
                      Vector3::UnitX(),
                      Vector3::UnitY(),
                      Vector3::UnitZ(),
                      {}};
  for (int a = 0; a < std::lround((high.x() - low.x()) / side); ++a)
    for (int b = 0; b < std::lround((high.y() - low.y()) / side); ++b)
      floor.cells.emplace_back(a, b);
  return floor;
}

/// A world that a scanner on a robot drives through, and what it measured.
struct PlanScene {
  std::string name;
  std::vector<Solid> solids;
  std::vector<Vector3> places;  ///< of the robot's wheels
  double sensor = 0.4;          ///< over them
  int rings = 32;
  double resolution = 0.1;      ///< of the map
  double turn = 0.0;            ///< of the world against the cells of map and plan, radians
  double noise = 0.0;           ///< of ranges, rms, metres
  std::vector<Vector3> points;  ///< all that was measured, in the axes of the solids

  PlanScene& add(const Vector3& low, const Vector3& high, double rise = 0.0) {
    solids.push_back({low, high, rise});
    return *this;
  }
  /// A corridor along x, 3 m wide, without a floor.
  PlanScene& walls(double from, double to, double bottom = -2.0) {
    add({from, 1.5, bottom}, {to, 1.7, 2.4});
    add({from, -1.7, bottom}, {to, -1.5, 2.4});
    add({from - 0.2, -1.7, bottom}, {from, 1.7, 2.4});
    return add({to, -1.7, bottom}, {to + 0.2, 1.7, 2.4});
  }
  PlanScene& floor(double from, double to, double top = 0.0, double rise = 0.0) {
    return add({from, -1.5, -2.0}, {to, 1.5, top}, rise);
  }
  PlanScene& drive(double from, double to, double step = 0.23) {
    for (double x = from; x <= to + 1e-9; x += step) places.push_back({x, 0.0, topBelow(x, 0, 1)});
    return *this;
  }
  /// The highest top at a place that is at most so high.
  double topBelow(double x, double y, double most) const {
    double top = -INFINITY;
    for (const Solid& s : solids)
      if (s.covers(x, y) && s.topAt(x) <= most) top = std::max(top, s.topAt(x));
    return top;
  }
  bool isBlocked(double x, double y, double floor, const RobotModel& robot) const {
    for (const Solid& s : solids)
      if (s.covers(x, y) && s.topAt(x) > floor + robot.max_step && s.low.z() < floor + robot.height)
        return true;
    return false;
  }

  PlanarMap map() {
    PlanarMapParams params;
    params.setResolution(resolution);
    PlanarMap map(params);
    Random random(1);
    const Eigen::AngleAxisd turned(turn, Vector3::UnitZ());
    double time = 0.0;
    for (const Vector3& place : places) {
      const Vector3 origin = place + sensor * Vector3::UnitZ();
      std::vector<float> xyz;
      for (int ring = 0; ring < rings; ++ring) {
        const double elevation = (-25.0 + 40.0 * ring / (rings - 1)) * M_PI / 180.0;
        for (int column = 0; column < 720; ++column) {
          const double azimuth = column * M_PI / 360.0;
          const Vector3 ray(std::cos(elevation) * std::cos(azimuth),
                            std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
          double range = 30.0;
          for (const Solid& s : solids) range = std::min(range, s.entry(origin, ray));
          if (range >= 30.0) continue;
          if (noise > 0.0) range += noise * random.normal();
          for (int k = 0; k < 3; ++k) xyz.push_back(static_cast<float>(range * ray[k]));
          points.push_back(origin + range * ray);
        }
      }
      MultiPlaneParams search;
      search.min_inliers = static_cast<int>(xyz.size() / 900);
      FrameObservation frame;
      frame.points = PointsView(xyz.data(), static_cast<std::uint32_t>(xyz.size() / 3));
      const PlaneSet planes = findPlanes(frame.points, nullptr, search);
      frame.planes = &planes.planes;
      frame.T_world_sensor.linear() = turned.toRotationMatrix();
      frame.T_world_sensor.translation() = turned * origin;
      frame.timestamp = time++;
      map.insert(frame);
    }
    return map;
  }
};

/// What a plan says against what is there.
struct PlanFigures {
  int over_drops = 0;    ///< free cells
  int in_obstacles = 0;  ///< free cells
  int drivable = 0;      ///< cells with a measured floor, a cell from any edge and obstacle
  int free = 0;          ///< of these
};

inline PlanFigures figuresOf(const PlanScene& scene, const Plan& plan, const RobotModel& robot) {
  PlanFigures figures;
  const Eigen::Rotation2Dd turned(scene.turn);
  const auto middle = [&](std::uint32_t x, std::uint32_t y) -> Vector2 {
    return turned.inverse() * (plan.origin + plan.cell * Vector2(x + 0.5, y + 0.5));
  };
  const auto cellOf = [&](const Vector3& place, std::uint32_t& x, std::uint32_t& y) {
    const Vector2 at = turned * Vector2(place.head<2>());
    return plan.cellOf(at.x(), at.y(), x, y);
  };
  // Floors that the robot reaches, cell by cell.
  std::vector<double> floor(plan.values.size(), NAN);
  std::deque<std::size_t> open;
  for (const Vector3& place : scene.places) {
    std::uint32_t x = 0, y = 0;
    if (!cellOf(place, x, y)) continue;
    floor[y * plan.width + x] = place.z();
    open.push_back(y * plan.width + x);
  }
  const auto next = [&](std::size_t cell, int dx, int dy) -> std::size_t {
    const int x = static_cast<int>(cell % plan.width) + dx;
    const int y = static_cast<int>(cell / plan.width) + dy;
    const bool has =
        x >= 0 && y >= 0 && x < static_cast<int>(plan.width) && y < static_cast<int>(plan.height);
    return has ? static_cast<std::size_t>(y) * plan.width + static_cast<std::size_t>(x)
               : plan.values.size();
  };
  const auto step = [&](std::size_t cell, std::size_t to) {
    const Vector2 at = middle(static_cast<std::uint32_t>(to % plan.width),
                              static_cast<std::uint32_t>(to / plan.width));
    const double top = scene.topBelow(at.x(), at.y(), floor[cell] + robot.max_step);
    const bool is_floor =
        floor[cell] - top <= robot.max_step && !scene.isBlocked(at.x(), at.y(), top, robot);
    return is_floor ? top : NAN;
  };
  while (!open.empty()) {
    const std::size_t cell = open.front();
    open.pop_front();
    for (const auto& [dx, dy] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
      const std::size_t to = next(cell, dx, dy);
      if (to == plan.values.size() || !std::isnan(floor[to])) continue;
      floor[to] = step(cell, to);
      if (!std::isnan(floor[to])) open.push_back(to);
    }
  }
  std::set<std::size_t> measured;
  for (const Vector3& p : scene.points) {
    std::uint32_t x = 0, y = 0;
    if (!cellOf(p, x, y)) continue;
    const std::size_t cell = y * plan.width + x;
    if (std::abs(p.z() - floor[cell]) < 0.05) measured.insert(cell);
  }
  for (std::size_t cell = 0; cell < plan.values.size(); ++cell) {
    const bool is_free = plan.values[cell] == Plan::kFree;
    if (is_free) {
      const Vector2 at = middle(static_cast<std::uint32_t>(cell % plan.width),
                                static_cast<std::uint32_t>(cell / plan.width));
      const double height = plan.heights[cell];
      const double top = scene.topBelow(at.x(), at.y(), height + robot.max_step);
      figures.over_drops += height - top > robot.max_step ? 1 : 0;
      figures.in_obstacles += scene.isBlocked(at.x(), at.y(), height + 0.05, robot) ? 1 : 0;
    }
    bool is_inner = measured.count(cell) > 0;
    for (int dy = -1; dy <= 1 && is_inner; ++dy)
      for (int dx = -1; dx <= 1 && is_inner; ++dx) {
        const std::size_t to = next(cell, dx, dy);
        is_inner = to != plan.values.size() && !std::isnan(floor[to]);
      }
    figures.drivable += is_inner ? 1 : 0;
    figures.free += is_inner && is_free ? 1 : 0;
  }
  return figures;
}

/// Edges, trenches, docks, pavements, ramps, stairs, tables and boards, from 0.4 and 1.2 m.
inline std::vector<PlanScene> planScenes() {
  std::vector<PlanScene> scenes;
  const auto begin = [&](const std::string& name, double sensor, int rings) -> PlanScene& {
    scenes.emplace_back();
    scenes.back().name = name;
    scenes.back().sensor = sensor;
    scenes.back().rings = rings;
    return scenes.back();
  };
  for (const auto& [sensor, rings] : {std::pair(0.4, 32), {0.4, 64}, {1.2, 32}, {1.2, 64}}) {
    const std::string eye =
        sensor < 1.0 ? " 0.4 m " + std::to_string(rings) : " 1.2 m " + std::to_string(rings);
    for (const auto& [width, depth] :
         {std::pair(0.2, 0.3), {0.2, 1.5}, {0.4, 0.6}, {0.6, 0.3}, {1.0, 0.3}, {1.0, 1.5}}) {
      PlanScene& scene = begin("trench " + std::to_string(width).substr(0, 3) + " x " +
                                   std::to_string(depth).substr(0, 3) + eye,
                               sensor, rings);

      scene.walls(-1.0, 10.0).floor(-1.0, 5.03).floor(5.03 + width, 10.0);
      scene.floor(5.03, 5.03 + width, -depth).drive(0.0, 4.5);
    }
    begin("dock down" + eye, sensor, rings)
        .walls(-1.0, 10.0)
        .floor(-1.0, 5.04)
        .floor(5.04, 10.0, -1.2)
        .drive(0.0, 4.5);
    PlanScene& pavement = begin("pavement" + eye, sensor, rings);
    pavement.add({-1, -0.64, -2}, {10, 1.5, 0}).add({-1, -4, -2}, {10, -0.64, -0.14});
    pavement.add({-1, 1.5, -2}, {10, 1.7, 2.4}).add({-1, -4.2, -2}, {10, -4, 2.4});
    pavement.add({-1.2, -4, -2}, {-1, 1.5, 2.4}).add({10, -4, -2}, {10.2, 1.5, 2.4}).drive(0, 6);
    begin("ramp" + eye, sensor, rings)
        .walls(-1.0, 10.0)
        .floor(-1.0, 3.0)
        .floor(3.0, 6.0, 0.0, 0.14)
        .floor(6.0, 10.0, 0.42)
        .drive(0.0, 8.0);
    PlanScene& up = begin("stairs up" + eye, sensor, rings).walls(-1.0, 10.0).floor(-1.0, 5.0);
    for (int i = 0; i < 8; ++i) up.floor(5.0 + 0.3 * i, 5.3 + 0.3 * i, 0.17 * (i + 1));
    up.floor(7.4, 10.0, 8 * 0.17).drive(0.0, 4.0);
    PlanScene& down =
        begin("stairs down" + eye, sensor, rings).walls(-1.0, 10.0, -3.0).floor(-1.0, 5.0);
    for (int i = 0; i < 8; ++i) down.floor(5.0 + 0.3 * i, 5.3 + 0.3 * i, -0.17 * (i + 1));
    down.floor(7.4, 10.0, -8 * 0.17).drive(0.0, 4.5);
    begin("table" + eye, sensor, rings)
        .walls(-1.0, 10.0)
        .floor(-1.0, 10.0)
        .add({4.0, 0.3, 0.67}, {5.8, 1.3, 0.73})
        .drive(0.0, 7.0);
    begin("board" + eye, sensor, rings)
        .walls(-1.0, 10.0)
        .floor(-1.0, 10.0)
        .add({4.0, 0.3, 0.0}, {6.0, 0.32, 0.3})
        .add({6.5, -1.5, 0.9}, {6.6, -0.5, 1.1})
        .drive(0.0, 8.0);
  }
  // Worlds that lie across the cells, of a scanner with noise.
  const std::size_t straight = scenes.size();
  for (std::size_t i = 0; i < straight; ++i) {
    if (scenes[i].name.find("0.4 m 32") == std::string::npos &&
        scenes[i].name.find("1.2 m 64") == std::string::npos)
      continue;
    scenes.push_back(scenes[i]);
    scenes.back().name += " turned";
    scenes.back().turn = 0.5;
    scenes.back().noise = 0.01;
    // Cells of 0.1 m that lie across a gap of 0.2 m may all hold points of its borders.
    if (scenes[i].name.substr(0, 10) == "trench 0.2") scenes.back().resolution = 0.05;
  }
  return scenes;
}

}  // namespace planar_mapping::test
