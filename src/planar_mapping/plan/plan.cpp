// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/plan/plan.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/map/planar_map_impl.h"
#include "planar_mapping/plan/plan_builder.h"

namespace planar_mapping {
namespace {

/// Squared distances along a line of values: the lower envelope of a parabola over each.
void transformLine(const float* f, std::size_t n, float* result, std::vector<std::size_t>& roots,
                   std::vector<double>& from) {
  std::size_t parabolas = 0;
  for (std::size_t q = 0; q < n; ++q) {
    if (std::isinf(f[q])) continue;
    double start = -INFINITY;
    while (parabolas > 0) {
      const auto p = double(roots[parabolas - 1]), at = double(q);
      start =
          ((double(f[q]) + at * at) - (double(f[roots[parabolas - 1]]) + p * p)) / (2.0 * (at - p));
      if (start > from[parabolas - 1]) break;
      --parabolas;
      start = -INFINITY;
    }
    roots[parabolas] = q;
    from[parabolas++] = start;
  }
  for (std::size_t q = 0, k = 0; q < n; ++q) {
    if (parabolas == 0) {
      result[q] = INFINITY;
      continue;
    }
    while (k + 1 < parabolas && from[k + 1] <= double(q)) ++k;
    const double off = double(q) - double(roots[k]);
    result[q] = float(off * off + double(f[roots[k]]));
  }
}

PlanSource sourceOf(const PlanarMap& map, std::vector<Cuboid> space) {
  PlanSource source;
  source.occupied = map.cuboids();
  source.space = std::move(space);
  source.unseen = map.params().unseen;
  source.up = map.params().approximation.up.normalized();
  source.ground = map.ground();
  source.planes = map.planes();
  source.floors = measuredFloors(map);
  source.resolution = map.params().approximation.resolution;
  // Of a merged cloud the origin is no sensor's.
  source.knows_sides = map.params().unknown_space;
  if (source.knows_sides)
    for (const auto& [time, pose] : map.trajectory()) source.path.push_back(pose.translation());
  return source;
}

}  // namespace

void RobotModel::validate() const {
  requireInRange("robot height", height, 0.01, 100.0, "m");
  requireInRange("robot radius", radius, 0.0, 100.0, "m");
  requireInRange("max step", max_step, 0.0, 10.0, "m");
  requireInRange("max slope", max_slope, 0.0, kSteepest, "rad");
  if (!std::isnan(camera_height)) requireInRange("camera height", camera_height, 0.0, 1000.0, "m");
  if (!(max_step < height))
    throw ParameterError("a step of " + std::to_string(max_step) + " m is as high as the robot");
}

double Plan::freeFraction() const {
  const auto free = std::count(values.begin(), values.end(), kFree);
  const auto occupied = std::count(values.begin(), values.end(), kOccupied);
  return free > 0 ? double(free) / double(free + occupied) : 0.0;
}

std::vector<float> Plan::distances() const {
  std::vector<float> field(values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    field[i] = values[i] == kOccupied ? 0.0f : INFINITY;
  const std::size_t longest = std::max(width, height);
  std::vector<float> line(longest), result(longest);
  std::vector<std::size_t> roots(longest);
  std::vector<double> from(longest);
  for (std::size_t x = 0; x < width; ++x) {
    for (std::size_t y = 0; y < height; ++y) line[y] = field[y * width + x];
    transformLine(line.data(), height, result.data(), roots, from);
    for (std::size_t y = 0; y < height; ++y) field[y * width + x] = result[y];
  }
  for (std::size_t y = 0; y < height; ++y) {
    transformLine(&field[y * width], width, result.data(), roots, from);
    std::copy_n(result.begin(), width, &field[y * width]);
  }
  for (float& value : field) value = float(cell * std::sqrt(double(value)));
  return field;
}

void PlanSource::turn(const Quaternion& turn) {
  for (std::vector<Cuboid>* list : {&occupied, &space}) {
    for (Cuboid& cuboid : *list) {
      cuboid.center = turn * cuboid.center;
      cuboid.orientation = turn * cuboid.orientation;
    }
  }
  for (GroundPoint& point : ground) point.position = turn * point.position;
  for (Vector3& place : path) place = turn * place;
  for (MapPlane& plane : planes) plane.plane.normal = turn * plane.plane.normal;
  for (MeasuredCells& floor : floors)
    for (Vector3* axis : {&floor.origin, &floor.u, &floor.v, &floor.n}) *axis = turn * *axis;
  up = turn * up;
}

std::vector<MeasuredCells> measuredFloors(const PlanarMap& map) {
  const Vector3 up = map.params().approximation.up.normalized();
  std::vector<MeasuredCells> floors;
  for (const detail::PlaneLayer& layer : detail::MapAccess::of(map).data.planes) {
    const PlaneFrame& frame = layer.frame();
    if (std::abs(frame.n.dot(up)) < std::cos(RobotModel::kSteepest)) continue;
    MeasuredCells floor{frame.origin, frame.u, frame.v, frame.n, {}};
    layer.raster.forEachTile([&](std::int32_t a, std::int32_t b, const detail::RasterTile& tile) {
      detail::forEachBit(tile.occupied(), [&](std::size_t bit) {
        floor.cells.emplace_back(8 * a + std::int32_t(bit & 7U), 8 * b + std::int32_t(bit >> 3U));
      });
    });
    floors.push_back(std::move(floor));
  }
  return floors;
}

PlanSource planSourceOf(const PlanarMap& map) {
  return sourceOf(
      map, map.params().unseen == Unseen::Unknown ? map.freeCuboids() : map.unknownCuboids());
}

std::vector<Plan> plansOf(PlanSource source, const RobotModel& robot, double cell) {
  requireInRange("cell", cell, 0.0, 1e9, "m");
  robot.validate();
  return detail::PlanBuilder(std::move(source), robot, cell).plans();
}

std::vector<Plan> plansOf(const PlanarMap& map, const RobotModel& robot, double cell) {
  return plansOf(planSourceOf(map), robot, cell);
}

const Plan& storeyBelow(const std::vector<Plan>& plans, double height) {
  const Plan* best = &plans.at(0);
  for (const Plan& plan : plans)
    if (plan.floor < height && plan.floor > best->floor) best = &plan;
  return *best;
}

Plan planAround(const PlanarMap& map, const Vector3& sensor, double reach, const RobotModel& robot,
                double cell) {
  constexpr double kStorey = 10.0;  // metres above and below
  requireInRange("reach", reach, 0.0, 1e6, "m");
  if (!sensor.allFinite()) throw ParameterError("the place of a sensor must be finite");
  const Vector3 up = map.params().approximation.up.normalized();
  const Vector3 half = (reach + (kStorey - reach) * up.cwiseAbs().array()).max(reach);
  const Vector3 low = sensor - half, high = sensor + half;
  const CellState state =
      map.params().unseen == Unseen::Unknown ? CellState::Free : CellState::Unknown;
  PlanSource source = sourceOf(map, map.spaceCuboids(state, low, high));
  const auto is_away = [&](const Vector3& at, const Vector3& grow) {
    return ((at - sensor).cwiseAbs().array() > (half + grow).array()).any();
  };
  detail::eraseIf(source.occupied,
                  [&](const Cuboid& c) { return is_away(c.center, planar_mapping::reach(c)); });
  detail::eraseIf(source.ground,
                  [&](const GroundPoint& p) { return is_away(p.position, Vector3::Zero()); });
  detail::eraseIf(source.path, [&](const Vector3& p) { return is_away(p, Vector3::Zero()); });
  source.path.push_back(sensor);
  return storeyBelow(plansOf(std::move(source), robot, cell), up.dot(sensor));
}

double floorHeight(const std::vector<Cuboid>& cuboids, const Vector3& up,
                   const std::vector<Vector3>& sensors) {
  constexpr double kStep = 0.1;  // heights that are one floor, metres
  if (cuboids.empty()) return 0.0;
  // Of the middle one of the sensors by height: floors around it and below.
  constexpr double kAround = 10.0;  // metres
  std::vector<Vector3> ranked = sensors;
  const auto middle = ranked.begin() + static_cast<std::ptrdiff_t>(ranked.size() / 2);
  const auto lower = [&](const Vector3& a, const Vector3& b) { return up.dot(a) < up.dot(b); };
  if (!ranked.empty()) std::nth_element(ranked.begin(), middle, ranked.end(), lower);
  const auto isBelow = [&](const Cuboid& cuboid, double height) {
    if (ranked.empty()) return true;
    const Vector3 to = cuboid.center - *middle;
    return height <= up.dot(*middle) &&
           (to - up.dot(to) * up).norm() - 0.5 * cuboid.size.norm() <= kAround;
  };
  std::map<long, std::pair<double, double>> floors;  // area, area times height
  double lowest = INFINITY;
  for (const Cuboid& cuboid : cuboids) {
    lowest = std::min(lowest, up.dot(cuboid.center) + halfAlong(cuboid, up));
    const Vector3 rise = (cuboid.orientation.conjugate() * up).cwiseAbs();
    Eigen::Index axis = 0;
    if (rise.maxCoeff(&axis) < std::cos(RobotModel().max_slope)) continue;
    if (cuboid.plane_id < 0 || cuboid.size[axis] > cuboid.size.minCoeff() + 1e-9) continue;
    const double height = up.dot(cuboid.center) + 0.5 * cuboid.size[axis] * rise[axis];
    if (!isBelow(cuboid, height)) continue;
    auto& floor = floors[std::lround(up.dot(cuboid.center) / kStep)];
    const double area = cuboid.volume() / cuboid.size[axis];
    floor.first += area;
    floor.second += area * height;
  }
  double most = 0.0, height = lowest;
  for (const auto& [bin, floor] : floors) {
    if (floor.first <= most) continue;
    most = floor.first;
    height = floor.second / floor.first;
  }
  return height;
}

}  // namespace planar_mapping
