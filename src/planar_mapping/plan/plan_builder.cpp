// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// What of the floors is free, reached and no edge, and the plans of it.
#include "planar_mapping/plan/plan_builder.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/geometry/turning.h"

namespace planar_mapping::detail {
namespace {

constexpr double kMaxCells = 5e7;

}  // namespace

PlanBuilder::PlanBuilder(PlanSource source, const RobotModel& robot, double cell)
    : source_(std::move(source)), robot_(robot) {
  source_.turn(turning(source_.up, Vector3::UnitZ()));
  eraseIf(source_.occupied, [](const Cuboid& c) { return c.state != CellState::Occupied; });
  raster_.cell = cell > 0.0 ? cell : source_.resolution;
}

std::vector<Plan> PlanBuilder::plans() {
  placeRaster();
  addFaces();
  addMeasured();
  addGround();
  sortLevels();
  stackObstacles();
  addPath();
  lookAbove();
  reach();
  findEdges();
  const std::vector<double> storeys = storeyHeights();
  std::vector<Plan> plans;
  for (std::size_t i = 0; i < storeys.size(); ++i) plans.push_back(planOf(storeys, i));
  return plans;
}

void PlanBuilder::placeRaster() {
  Eigen::AlignedBox2d box;
  for (const Cuboid& cuboid : source_.occupied) {
    const Vector3 half = planar_mapping::reach(cuboid);
    box.extend(Eigen::Vector2d((cuboid.center - half).head<2>()));
    box.extend(Eigen::Vector2d((cuboid.center + half).head<2>()));
  }
  for (const GroundPoint& point : source_.ground) {
    box.extend(Eigen::Vector2d(point.position.head<2>().array() - 1.0));
    box.extend(Eigen::Vector2d(point.position.head<2>().array() + 1.0));
  }
  for (const Vector3& place : source_.path) {
    box.extend(Eigen::Vector2d(place.head<2>().array() - robot_.radius));
    box.extend(Eigen::Vector2d(place.head<2>().array() + robot_.radius));
  }
  if (box.isEmpty()) box = Eigen::AlignedBox2d(Eigen::Vector2d(0, 0), Eigen::Vector2d(0, 0));
  const double cell = raster_.cell;
  const Eigen::Vector2d first = (box.min() / cell).array() + 1e-6;
  const Eigen::Vector2d last = (box.max() / cell).array() - 1e-6;
  const Eigen::Vector2d begin = first.array().floor();
  const Eigen::Vector2d count = (last.array().ceil() - begin.array()).max(1.0);
  if (!(count.prod() <= kMaxCells)) {
    const double smallest = cell * std::sqrt(count.prod() / kMaxCells);
    throw ParameterError("cells of " + std::to_string(cell) +
                         " m make a grid of more than 50 million; take at least --cell " +
                         std::to_string(1.1 * smallest));
  }
  raster_.origin = cell * begin;
  raster_.width = int(count.x());
  raster_.height = int(count.y());
}

template <typename Visit>
void PlanBuilder::forNeighbours(std::size_t cell, int reach, const Visit& visit) const {
  const int x = raster_.xOf(cell), y = raster_.yOf(cell);
  const int left = std::max(-reach, -x), right = std::min(reach, raster_.width - 1 - x);
  const int below = std::max(-reach, -y), above = std::min(reach, raster_.height - 1 - y);
  for (int dy = below; dy <= above; ++dy)
    for (int dx = left; dx <= right; ++dx)
      if (dx != 0 || dy != 0) visit(raster_.at(x + dx, y + dy), dx * dx + dy * dy);
}

void PlanBuilder::stackObstacles() {
  CellLists<Interval>::Found found;
  for (const Cuboid& cuboid : source_.occupied) {
    const Matrix3 to_local = cuboid.orientation.conjugate().toRotationMatrix();
    const Vector3 half = planar_mapping::reach(cuboid);
    // Points are in the middle of grid cells and of the cuboids of level faces.
    const bool is_level =
        cuboid.plane_id >= 0 && std::abs(to_local(2, 2)) > std::cos(robot_.max_slope);
    const double lower = cuboid.plane_id < 0 ? 0.5 * source_.resolution
                         : is_level          ? 0.5 * cuboid.size.z()
                                             : 0.0;
    raster_.around(cuboid.center.head<2>(), half.head<2>(), [&](int x, int y) {
      double low = 0.0, high = 0.0;
      const double grow = (0.5 - 1e-6) * raster_.cell;
      if (!spanOf(cuboid, to_local, raster_.middleOf(x, y), grow, low, high)) return;
      low = std::max(low, cuboid.center.z() - half.z());
      high = std::min(high, cuboid.center.z() + half.z());
      if (low > high) return;
      found.emplace_back(std::uint32_t(raster_.at(x, y)),
                         Interval{float(low), float(std::max(low, high - lower))});
    });
  }
  obstacles_.build(raster_.count(), found);
}

bool PlanBuilder::isBlocked(std::size_t cell, double floor) const {
  for (std::uint32_t i = obstacles_.begin(cell); i < obstacles_.end(cell); ++i)
    if (obstacles_[i].high > floor + robot_.max_step && obstacles_[i].low < floor + robot_.height)
      return true;
  return false;
}

void PlanBuilder::lookAbove() {
  states_.assign(levels_.size(), {});
  float low = INFINITY, high = -INFINITY;
  for (std::uint32_t i = 0; i < levels_.size(); ++i) {
    low = std::min(low, levels_[i].height);
    high = std::max(high, levels_[i].height);
  }
  if (!(low <= high)) low = high = 0.0f;
  free_.emplace(raster_, low - 2.0 * robot_.max_step - 4.0 * source_.resolution,
                high + robot_.height + 2.0 * source_.resolution, source_.resolution);
  for (const Cuboid& cuboid : source_.space) {
    const Matrix3 to_local = cuboid.orientation.conjugate().toRotationMatrix();
    const Vector3 half = planar_mapping::reach(cuboid);
    if (to_local.diagonal().minCoeff() > 1.0 - 1e-12) {  // most are along the axes
      const FreeColumns::Steps steps =
          free_->stepsOf(cuboid.center.z() - half.z(), cuboid.center.z() + half.z());
      const Vector2 inside = half.head<2>().array() + 1e-9;
      raster_.around(cuboid.center.head<2>(), half.head<2>(), [&](int x, int y) {
        const Vector2 off = raster_.middleOf(x, y) - cuboid.center.head<2>();
        if (std::abs(off.x()) <= inside.x() && std::abs(off.y()) <= inside.y())
          free_->mark(raster_.at(x, y), steps);
      });
      continue;
    }
    raster_.around(cuboid.center.head<2>(), half.head<2>(), [&](int x, int y) {
      double from = 0.0, to = 0.0;
      if (spanOf(cuboid, to_local, raster_.middleOf(x, y), 0.0, from, to))
        free_->mark(raster_.at(x, y), free_->stepsOf(from, to));
    });
  }
  if (source_.unseen == Unseen::Free) free_->invert();
  for (std::uint32_t i = 0; i < levels_.size(); ++i) {
    const FloorLevel& level = levels_[i];
    const double from = level.height + robot_.max_step;
    const double to = std::max(level.height + robot_.height, from + source_.resolution);
    // The first and the last step of the column are cut by what stands below and above.
    const FreeColumns::Count all = free_->count(cell_of_[i], from, to);
    const FreeColumns::Count inner =
        free_->count(cell_of_[i], from + source_.resolution, to - source_.resolution);
    const bool is_path = level.kind == FloorLevel::Kind::Path;
    states_[i].is_blocked = isBlocked(cell_of_[i], level.height);
    states_[i].is_seen = is_path || (inner.free == inner.all && 2 * all.free >= all.all);
    states_[i].is_hollow = !is_path && isHollow(cell_of_[i], level.height, source_.resolution);
  }
}

void PlanBuilder::reach() {
  if (seeds_.empty() && levels_.size() > 0) {
    // Where the robot was is not known: on the largest floor that one can stand on, no table.
    markParts();
    const auto rankOf = [&](std::uint32_t i) {
      if (states_[i].is_blocked || !levels_[i].isMeasured() || part_area_[i] < kMinFloor)
        return 0.0;
      return part_area_[i] + (states_[i].is_seen ? kMaxCells : 0.0);
    };
    std::uint32_t largest = 0;
    for (std::uint32_t i = 1; i < levels_.size(); ++i)
      if (rankOf(i) > rankOf(largest)) largest = i;
    if (rankOf(largest) > 0.0) seeds_.push_back(largest);
  }
  std::vector<std::uint32_t> open;
  const auto take = [&](std::uint32_t i) {
    if (states_[i].is_reached) return;
    states_[i].is_reached = true;
    // Nothing goes on from what stands on a floor: a heap is no ramp.
    if (!states_[i].is_blocked && levels_[i].kind != FloorLevel::Kind::Clutter) open.push_back(i);
  };
  for (const std::uint32_t seed : seeds_) take(seed);
  while (!open.empty()) {
    const std::uint32_t i = open.back();
    open.pop_back();
    forNeighbours(cell_of_[i], 2, [&](std::size_t cell, int) {
      for (std::uint32_t k = levels_.begin(cell); k < levels_.end(cell); ++k)
        if (!states_[k].is_reached &&
            std::abs(levels_[k].height - levels_[i].height) <= robot_.max_step)
          take(k);
    });
  }
}

bool PlanBuilder::isHollow(std::size_t cell, double floor, double thickness) const {
  // Where all is free that nobody saw, free space says nothing.
  if (source_.unseen == Unseen::Free) return false;
  const double below = floor - robot_.max_step;
  return free_->count(cell, below - thickness, below).free > 0;
}

void PlanBuilder::findEdges() {
  const int reach = std::max(1, int(std::lround(source_.resolution / raster_.cell)));
  const double steepest = std::tan(robot_.max_slope);
  for (std::uint32_t i = 0; i < levels_.size(); ++i) {
    if (!states_[i].is_reached || states_[i].is_blocked) continue;
    const double height = levels_[i].height;
    states_[i].is_rim = !levels_[i].isMeasured();
    // Of two floors without headroom between them the upper one is none, or an edge.
    for (std::uint32_t k = levels_.begin(cell_of_[i]); k < levels_.end(cell_of_[i]); ++k)
      if (levels_[k].isMeasured() && levels_[k].height < height - robot_.max_step &&
          levels_[k].height > height - robot_.height)
        states_[i].is_edge = true;
    // Where space below the floor was seen there is a gap in it that its cuboids bridge.
    states_[i].is_edge |= states_[i].is_hollow;
    forNeighbours(cell_of_[i], reach, [&](std::size_t cell, int squared) {
      const double tolerance =
          std::max(robot_.max_step, std::sqrt(double(squared)) * raster_.cell * steepest);
      const auto next = levelNear(cell, height, tolerance);
      const bool is_floor = next && levels_[*next].isMeasured();
      if ((is_floor && !states_[*next].is_hollow) || isBlocked(cell, height)) return;
      if (is_floor) {
        states_[i].is_edge = true;
        return;
      }
      // Points that no plane holds may lie in a gap, or be a floor of which little was measured.
      if (next && levels_[*next].kind == FloorLevel::Kind::Clutter && !states_[*next].is_hollow) {
        states_[i].is_rim = true;
        return;
      }
      bool is_drop = false;
      for (std::uint32_t k = levels_.begin(cell); k < levels_.end(cell); ++k)
        is_drop |= levels_[k].height < height - tolerance;
      is_drop |= isHollow(cell, height, 2.0 * source_.resolution);
      (is_drop ? states_[i].is_edge : states_[i].is_rim) = true;
    });
    // The robot stood there.
    if (levels_[i].kind == FloorLevel::Kind::Path) states_[i].is_rim = false;
  }
}

std::vector<double> PlanBuilder::storeyHeights() const {
  std::vector<float> heights;
  bool is_one = true;
  for (std::size_t cell = 0; cell < raster_.count(); ++cell) {
    int here = 0;
    for (std::uint32_t i = levels_.begin(cell); i < levels_.end(cell); ++i) {
      if (!states_[i].is_reached || states_[i].is_blocked) continue;
      heights.push_back(levels_[i].height);
      is_one = is_one && ++here < 2;
    }
  }
  if (heights.empty()) return {0.0};
  if (is_one) return {ranked(heights, heights.size() / 2)};
  std::sort(heights.begin(), heights.end());
  std::vector<double> storeys;
  // The most floor within a step, then what is a robot's height away from it.
  while (true) {
    std::size_t most = 0, from = 0;
    double best = 0.0;
    for (std::size_t to = 0; to < heights.size(); ++to) {
      while (heights[to] - heights[from] > robot_.max_step) ++from;
      if (to - from + 1 <= most) continue;
      most = to - from + 1;
      best = heights[from + (to - from) / 2];
    }
    if (double(most) * raster_.cell * raster_.cell < kMinFloor && !storeys.empty()) break;
    storeys.push_back(best);
    const auto is_near = [&](float h) { return std::abs(h - best) < robot_.height; };
    eraseIf(heights, is_near);
    if (heights.empty()) break;
  }
  std::sort(storeys.begin(), storeys.end());
  return storeys;
}

Plan PlanBuilder::planOf(const std::vector<double>& storeys, std::size_t storey) const {
  // Stairs between two storeys are in both plans.
  const double low = storey == 0 ? -INFINITY : storeys[storey - 1] + robot_.max_step;
  const double high =
      storey + 1 == storeys.size() ? INFINITY : storeys[storey + 1] - robot_.max_step;
  Plan plan;
  plan.width = std::uint32_t(raster_.width);
  plan.height = std::uint32_t(raster_.height);
  plan.cell = raster_.cell;
  plan.origin = raster_.origin;
  plan.values.assign(raster_.count(), Plan::kUnknown);
  plan.heights.assign(raster_.count(), NAN);
  std::vector<std::uint32_t> chosen;
  std::vector<float> floor(raster_.count(), NAN);  // of the nearest cell that is reached
  std::vector<std::uint32_t> open;
  for (std::size_t cell = 0; cell < raster_.count(); ++cell) {
    const std::uint32_t none = std::uint32_t(-1);
    std::uint32_t best = none;
    for (std::uint32_t i = levels_.begin(cell); i < levels_.end(cell); ++i) {
      const double h = levels_[i].height;
      if (!states_[i].is_reached || h <= low || h >= high) continue;
      if (best == none ||
          std::abs(h - storeys[storey]) < std::abs(levels_[best].height - storeys[storey]))
        best = i;
    }
    if (best == none) continue;
    const State& state = states_[best];
    chosen.push_back(best);
    if (state.is_blocked || state.is_edge) {
      plan.values[cell] = Plan::kOccupied;
    } else if (state.isStandable()) {
      plan.values[cell] = Plan::kFree;
    }
    floor[cell] = plan.heights[cell] = levels_[best].height;
    open.push_back(std::uint32_t(cell));
  }
  if (chosen.empty()) {  // what stands is shown nevertheless
    const double guess = floorHeight(source_.occupied, Vector3::UnitZ(), source_.path);
    for (std::size_t cell = 0; cell < raster_.count(); ++cell)
      if (isBlocked(cell, guess)) plan.values[cell] = Plan::kOccupied;
  }
  for (std::size_t k = 0; k < open.size(); ++k) {
    const std::uint32_t cell = open[k];
    const int x = raster_.xOf(cell), y = raster_.yOf(cell);
    for (const auto& [nx, ny] : {std::pair(x + 1, y), {x - 1, y}, {x, y + 1}, {x, y - 1}}) {
      if (!raster_.has(nx, ny)) continue;
      const std::size_t next = raster_.at(nx, ny);
      if (!std::isnan(floor[next])) continue;
      floor[next] = floor[cell];
      if (isBlocked(next, floor[next])) plan.values[next] = Plan::kOccupied;
      open.push_back(std::uint32_t(next));
    }
  }
  // No robot passes between two obstacles a cell apart: of a board, noise left that cell empty.
  const std::vector<std::int8_t> found = plan.values;
  const auto stands = [&](int x, int y) {
    return raster_.has(x, y) && found[raster_.at(x, y)] == Plan::kOccupied;
  };
  for (const std::uint32_t i : chosen) {
    if (raster_.cell >= 2.0 * robot_.radius || levels_[i].kind == FloorLevel::Kind::Path) continue;
    const std::size_t cell = cell_of_[i];
    const int x = raster_.xOf(cell), y = raster_.yOf(cell);
    for (const auto& [dx, dy] : {std::pair(1, 0), {0, 1}, {1, 1}, {1, -1}})
      if (stands(x + dx, y + dy) && stands(x - dx, y - dy)) plan.values[cell] = Plan::kOccupied;
  }
  std::vector<double> heights;
  heights.reserve(chosen.size());
  for (const std::uint32_t i : chosen) heights.push_back(levels_[i].height);
  if (!heights.empty()) {
    plan.floor = ranked(heights, heights.size() / 2);
  }
  plan.note = noteOf(plan, chosen);
  return plan;
}

std::string PlanBuilder::noteOf(const Plan& plan, const std::vector<std::uint32_t>& levels) const {
  const double area = raster_.cell * raster_.cell;
  std::size_t unseen = 0, measured = 0;
  for (const std::uint32_t i : levels) {
    measured += levels_[i].kind == FloorLevel::Kind::Floor ? 1 : 0;
    unseen += !states_[i].is_blocked && !states_[i].is_seen ? 1 : 0;
  }
  const double free = double(std::count(plan.values.begin(), plan.values.end(), Plan::kFree));
  char text[400];
  std::snprintf(text, sizeof text, "%.1f m2 free (%.0f %% of what is free or occupied)",
                area * free, 100.0 * plan.freeFraction());
  std::string note = text;
  if (measured == 0) {
    note += levels_.size() == 0 ? "; no floor was measured: no level face"
                                : "; no floor that the robot reaches was measured";
  } else if (free < 0.5 * double(levels.size())) {
    std::snprintf(text, sizeof text,
                  "; of %.1f m2 of floor %.1f m2 were not seen free up to %.2g m",
                  area * double(levels.size()), area * double(unseen), robot_.height);
    note += text;
    note += 2 * unseen > levels.size() ? ": a lower --robot-height or frames that look higher help"
                                       : "";
  }
  const std::vector<float> distances = plan.distances();
  bool fits = free == 0.0;
  for (std::size_t i = 0; i < distances.size() && !fits; ++i)
    fits = plan.values[i] == Plan::kFree && distances[i] > robot_.radius;
  if (!fits) note += "; the robot is too wide: each free cell is within its radius of an obstacle";
  if (source_.floors.empty() && levels_.size() > 0)
    note += "; where floors were measured is not known, as in finished maps: plan before finishing";
  if (!source_.ground.empty())
    note += "; removed ground is free only below the path: keep the ground for a plan";
  if (source_.path.empty())
    note +=
        "; the map has no path: the robot is taken to stand on the largest floor of 4 m2 or more";
  return note;
}

}  // namespace planar_mapping::detail
