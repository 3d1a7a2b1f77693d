// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/plan/plan_builder.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <numeric>

#include "planar_mapping/base/disjoint_parts.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/geometry/oriented_box.h"
#include "planar_mapping/geometry/turning.h"

namespace planar_mapping::detail {
namespace {

constexpr double kMaxCells = 5e7;
/// Of a sensor over the floor: a person holds a camera up to here, metres.
constexpr double kMaxCameraHeight = 2.5;
/// Smallest floor of a room: smaller level faces are furniture, square metres.
constexpr double kMinFloor = 4.0;
/// From a place of the path to the nearest floor that was seen: what cameras do not see of the
/// floor before them, metres.
constexpr double kBlindReach = 5.0;
/// Between two places of the path the robot went straight, metres.
constexpr double kMaxStride = 2.0;

/// Part of the vertical line through a place that is in a cuboid, grown along x and y.
bool spanOf(const Cuboid& cuboid, const Matrix3& to_local, const Vector2& at, double grow,
            double& low, double& high) {
  const Vector3 from = to_local * (Vector3(at.x(), at.y(), 0.0) - cuboid.center);
  const Vector3 half =
      0.5 * cuboid.size + grow * (to_local.col(0).cwiseAbs() + to_local.col(1).cwiseAbs());
  Vector3 along = to_local.col(2);
  for (double& a : along) a = std::abs(a) < 1e-9 ? 0.0 : a;
  low = -1e9;
  high = 1e9;
  return clipToBox(-half, half, from, along, low, high);
}

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
  markParts();
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
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      if ((dx == 0 && dy == 0) || !raster_.has(x + dx, y + dy)) continue;
      visit(raster_.at(x + dx, y + dy), std::sqrt(double(dx * dx + dy * dy)));
    }
  }
}

void PlanBuilder::addFaces() {
  const double least_rise = std::cos(robot_.max_slope);
  for (const Cuboid& cuboid : source_.occupied) {
    const Matrix3 axes = cuboid.orientation.toRotationMatrix();
    const Vector3 half = planar_mapping::reach(cuboid);
    Vector3 normal = axes.col(2);
    FloorLevel level;
    if (cuboid.plane_id < 0) {
      // The points of a grid cell are in its middle, as far as one knows.
      level.kind = FloorLevel::Kind::Clutter;
      level.height = float(cuboid.center.z() + half.z() - 0.5 * source_.resolution);
      raster_.around(cuboid.center.head<2>(), half.head<2>(), [&](int x, int y) {
        double low = 0.0, high = 0.0;
        if (spanOf(cuboid, axes.transpose(), raster_.middleOf(x, y), 0.0, low, high))
          found_.emplace_back(std::uint32_t(raster_.at(x, y)), level);
      });
      continue;
    }
    double offset = normal.dot(cuboid.center);
    const auto plane =
        std::lower_bound(source_.planes.begin(), source_.planes.end(), cuboid.plane_id,
                         [](const MapPlane& p, std::int32_t id) { return p.id < id; });
    if (plane != source_.planes.end() && plane->id == cuboid.plane_id &&
        std::abs(plane->plane.signedDistance(cuboid.center)) <= 0.5 * cuboid.size.z() + 1e-6) {
      normal = plane->plane.normal;
      offset = -plane->plane.offset;
    }
    if (!source_.knows_sides && normal.z() < 0.0) {
      normal = -normal;
      offset = -offset;
    }
    if (normal.z() < least_rise) continue;
    level.slope_x = float(-normal.x() / normal.z());
    level.slope_y = float(-normal.y() / normal.z());
    raster_.around(cuboid.center.head<2>(), half.head<2>(), [&](int x, int y) {
      const Vector2 at = raster_.middleOf(x, y);
      const double height = (offset - normal.x() * at.x() - normal.y() * at.y()) / normal.z();
      const Vector3 local = axes.transpose() * (Vector3(at.x(), at.y(), height) - cuboid.center);
      if (std::abs(local.x()) > 0.5 * cuboid.size.x() + 1e-9 ||
          std::abs(local.y()) > 0.5 * cuboid.size.y() + 1e-9)
        return;
      level.height = float(height);
      found_.emplace_back(std::uint32_t(raster_.at(x, y)), level);
    });
  }
}

void PlanBuilder::addMeasured() {
  FloorLevel level;
  level.kind = FloorLevel::Kind::Floor;
  for (const MeasuredCells& floor : source_.floors) {
    const double rise = source_.knows_sides ? floor.n.z() : std::abs(floor.n.z());
    if (rise < std::cos(robot_.max_slope)) continue;
    level.slope_x = float(-floor.n.x() / floor.n.z());
    level.slope_y = float(-floor.n.y() / floor.n.z());
    const double half = 0.5 * source_.resolution;
    const Vector2 reach = half * (floor.u.head<2>().cwiseAbs() + floor.v.head<2>().cwiseAbs());
    for (const auto& [a, b] : floor.cells) {
      const Vector3 middle =
          floor.origin + source_.resolution * ((a + 0.5) * floor.u + (b + 0.5) * floor.v);
      raster_.around(middle.head<2>(), reach, [&](int x, int y) {
        const Vector2 off = raster_.middleOf(x, y) - middle.head<2>();
        const Vector3 on(off.x(), off.y(), level.slope_x * off.x() + level.slope_y * off.y());
        if (std::abs(on.dot(floor.u)) > half + 1e-9 || std::abs(on.dot(floor.v)) > half + 1e-9)
          return;
        level.height = float(middle.z() + on.z());
        found_.emplace_back(std::uint32_t(raster_.at(x, y)), level);
      });
    }
  }
}

void PlanBuilder::addGround() {
  // Removed ground is known by its mean height in squares of 2 m; between their middles it is as
  // high as their mean by distance.
  constexpr double kSide = 2.0;
  CellLists<std::uint32_t>::Found near;
  const Vector2 reach = Vector2::Constant(kSide - 1e-6);
  for (std::uint32_t i = 0; i < source_.ground.size(); ++i)
    raster_.around(source_.ground[i].position.head<2>(), reach,
                   [&](int x, int y) { near.emplace_back(std::uint32_t(raster_.at(x, y)), i); });
  CellLists<std::uint32_t> places;
  places.build(raster_.count(), near);
  for (std::size_t cell = 0; cell < raster_.count(); ++cell) {
    const Vector2 at = raster_.middleOf(raster_.xOf(cell), raster_.yOf(cell));
    for (std::uint32_t i = places.begin(cell); i < places.end(cell); ++i) {
      const Vector3& middle = source_.ground[places[i]].position;
      if ((middle.head<2>() - at).cwiseAbs().maxCoeff() > 0.5 * kSide) continue;
      double sum = 0.0, weights = 0.0;
      for (std::uint32_t k = places.begin(cell); k < places.end(cell); ++k) {
        const Vector3& other = source_.ground[places[k]].position;
        // Ground that is not steeper goes on into the next square.
        if (std::abs(other.z() - middle.z()) > kSide * std::tan(robot_.max_slope)) continue;
        const Vector2 off = (other.head<2>() - at).cwiseAbs() / kSide;
        const double weight = std::max(0.0, 1.0 - off.x()) * std::max(0.0, 1.0 - off.y());
        sum += weight * other.z();
        weights += weight;
      }
      FloorLevel level;
      level.height = float(weights > 0.0 ? sum / weights : middle.z());
      found_.emplace_back(std::uint32_t(cell), level);
    }
  }
}

void PlanBuilder::sortLevels() {
  levels_.build(raster_.count(), found_);
  CellLists<FloorLevel>::Found kept;
  kept.reserve(found_.size());
  for (std::size_t cell = 0; cell < raster_.count(); ++cell) {
    const std::uint32_t begin = levels_.begin(cell), end = levels_.end(cell);
    if (begin == end) continue;
    std::sort(&levels_[begin], &levels_[begin] + (end - begin), [](const auto& a, const auto& b) {
      return a.height != b.height ? a.height > b.height : a.kind > b.kind;
    });
    kept.emplace_back(std::uint32_t(cell), levels_[begin]);
    for (std::uint32_t i = begin + 1; i < end; ++i) {
      const FloorLevel& level = levels_[i];
      FloorLevel& above = kept.back().second;
      if (above.height - level.height > robot_.max_step) {
        kept.emplace_back(std::uint32_t(cell), level);
      } else if (level.kind > above.kind) {
        above = level;  // what was measured says where the floor is; what lies on it is no obstacle
      }
    }
  }
  found_ = std::move(kept);
  levels_.build(raster_.count(), found_);
  cell_of_.clear();
  for (const auto& entry : found_) cell_of_.push_back(entry.first);
}

std::optional<std::uint32_t> PlanBuilder::levelNear(std::size_t cell, double height,
                                                    double tolerance) const {
  std::optional<std::uint32_t> nearest;
  double least = tolerance;
  for (std::uint32_t i = levels_.begin(cell); i < levels_.end(cell); ++i) {
    const double off = std::abs(levels_[i].height - height);
    if (off > least) continue;
    least = off;
    nearest = i;
  }
  return nearest;
}

void PlanBuilder::markParts() {
  DisjointParts parts(levels_.size());
  for (std::uint32_t i = 0; i < levels_.size(); ++i) {
    if (levels_[i].kind == FloorLevel::Kind::Clutter) continue;
    const int x = raster_.xOf(cell_of_[i]), y = raster_.yOf(cell_of_[i]);
    for (const auto& [nx, ny] : {std::pair(x + 1, y), {x, y + 1}}) {
      if (!raster_.has(nx, ny)) continue;
      const auto k = levelNear(raster_.at(nx, ny), levels_[i].height, robot_.max_step);
      if (k && levels_[*k].kind != FloorLevel::Kind::Clutter) parts.unite(i, *k);
    }
  }
  std::vector<double> area(levels_.size(), 0.0);
  for (std::uint32_t i = 0; i < levels_.size(); ++i)
    if (levels_[i].kind != FloorLevel::Kind::Clutter)
      area[parts.of(i)] += raster_.cell * raster_.cell;
  part_area_.resize(levels_.size());
  for (std::uint32_t i = 0; i < levels_.size(); ++i) part_area_[i] = area[parts.of(i)];
}

std::optional<std::uint32_t> PlanBuilder::floorUnder(const Vector3& sensor) const {
  const int x = raster_.columnOf(sensor.x()), y = raster_.rowOf(sensor.y());
  const int last = int(std::ceil(kBlindReach / raster_.cell));
  const int close = int(std::ceil(robot_.radius / raster_.cell));
  std::optional<std::uint32_t> best;
  double best_rank = 0.0;
  for (int ring = 0; ring <= last; ++ring) {
    const auto look = [&](int cx, int cy) {
      if (!raster_.has(cx, cy)) return;
      const std::size_t cell = raster_.at(cx, cy);
      for (std::uint32_t i = levels_.begin(cell); i < levels_.end(cell); ++i) {
        const FloorLevel& level = levels_[i];
        if (level.kind == FloorLevel::Kind::Clutter) continue;
        const Vector2 off = sensor.head<2>() - raster_.middleOf(cx, cy);
        const double height = level.height + level.slope_x * off.x() + level.slope_y * off.y();
        const double over = sensor.z() - height;
        const bool is_possible =
            std::isnan(robot_.camera_height)
                ? over > 0.0 && over <= kMaxCameraHeight
                : std::abs(over - robot_.camera_height) <= 2.0 * robot_.max_step;
        if (!is_possible) continue;
        // A floor of a room before furniture, then what is nearer, then what is higher.
        const double rank = std::min(part_area_[i], kMinFloor) * 1e4 - ring * 10.0 - over;
        if (!best || rank > best_rank) {
          best = i;
          best_rank = rank;
        }
      }
    };
    for (int d = -ring; d <= ring; ++d) {
      look(x + d, y - ring);
      if (ring > 0) look(x + d, y + ring);
      if (d > -ring && d < ring) {
        look(x - ring, y + d);
        look(x + ring, y + d);
      }
    }
    if (best && part_area_[*best] >= kMinFloor && ring >= close) break;
  }
  return best;
}

void PlanBuilder::addDisc(const Vector2& place, const Vector2& next, const FloorLevel& floor) {
  const Vector2 along = next - place;
  const double length = along.norm();
  const Vector2 reach = 0.5 * along.cwiseAbs() + Vector2::Constant(robot_.radius);
  const auto distance = [&](const Vector2& off) {
    const double t = length > 0.0 ? std::clamp(off.dot(along) / (length * length), 0.0, 1.0) : 0.0;
    return (off - t * along).norm();
  };
  const auto heightAt = [&](const Vector2& off) {
    return floor.height + float(floor.slope_x * off.x() + floor.slope_y * off.y());
  };
  // A robot that is wider than the way was there with less than its radius.
  double radius = robot_.radius;
  raster_.around(0.5 * (place + next), reach, [&](int x, int y) {
    const Vector2 off = raster_.middleOf(x, y) - place;
    const double away = distance(off);
    if (away < radius && isBlocked(raster_.at(x, y), heightAt(off))) radius = away;
  });
  raster_.around(0.5 * (place + next), reach, [&](int x, int y) {
    const Vector2 off = raster_.middleOf(x, y) - place;
    if (distance(off) > radius) return;
    FloorLevel level = floor;
    level.height = heightAt(off);
    level.kind = FloorLevel::Kind::Path;
    const std::size_t cell = raster_.at(x, y);
    const auto there = levelNear(cell, level.height, robot_.max_step);
    if (there) level.height = levels_[*there].height;
    if (!there || !levels_[*there].isMeasured()) {
      // A lower floor that was measured is a drop, not what the robot stood on.
      for (std::uint32_t i = levels_.begin(cell); i < levels_.end(cell); ++i)
        if (levels_[i].isMeasured() && levels_[i].height < level.height - robot_.max_step &&
            level.height - levels_[i].height < kMaxCameraHeight)
          return;
    }
    found_.emplace_back(std::uint32_t(cell), level);
  });
}

void PlanBuilder::addPath() {
  std::vector<std::pair<Vector2, FloorLevel>> floors;
  std::optional<Vector3> last;
  std::vector<std::pair<std::uint32_t, float>> stood;  // cells and heights of floors below
  for (const Vector3& sensor : source_.path) {
    // Frames of one place add nothing.
    if (last && (sensor - *last).norm() < 0.5 * raster_.cell) continue;
    last = sensor;
    const auto under = floorUnder(sensor);
    if (!under) continue;
    stood.emplace_back(cell_of_[*under], levels_[*under].height);
    FloorLevel floor = levels_[*under];
    const std::size_t cell = cell_of_[*under];
    const Vector2 off = sensor.head<2>() - raster_.middleOf(raster_.xOf(cell), raster_.yOf(cell));
    floor.height += float(floor.slope_x * off.x() + floor.slope_y * off.y());
    floors.emplace_back(sensor.head<2>(), floor);
  }
  for (std::size_t i = 0; i < floors.size(); ++i) {
    const auto& [place, floor] = floors[i];
    const bool goes_on = i + 1 < floors.size() &&
                         (floors[i + 1].first - place).norm() <= kMaxStride &&
                         std::abs(floors[i + 1].second.height - floor.height) <= robot_.max_step;
    addDisc(place, goes_on ? floors[i + 1].first : place, floor);
  }
  if (!floors.empty()) {
    sortLevels();
    markParts();
  }
  for (const auto& [cell, height] : stood)
    if (const auto level = levelNear(cell, height, robot_.max_step)) seeds_.push_back(*level);
  for (std::uint32_t i = 0; i < levels_.size(); ++i)
    if (levels_[i].kind == FloorLevel::Kind::Path) seeds_.push_back(i);
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
        free_->mark(raster_.at(x, y), from, to);
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
    states_[i].is_blocked = isBlocked(cell_of_[i], level.height);
    states_[i].is_seen = level.kind == FloorLevel::Kind::Path ||
                         (inner.free == inner.all && 2 * all.free >= all.all);
  }
}

void PlanBuilder::reach() {
  if (seeds_.empty() && levels_.size() > 0) {
    // Where the robot was is not known: on the largest floor that one can stand on.
    const auto rankOf = [&](std::uint32_t i) {
      if (states_[i].is_blocked || !levels_[i].isMeasured()) return 0.0;
      return part_area_[i] + (states_[i].is_seen ? kMaxCells : 0.0);
    };
    std::uint32_t largest = 0;
    for (std::uint32_t i = 1; i < levels_.size(); ++i)
      if (rankOf(i) > rankOf(largest)) largest = i;
    if (rankOf(largest) > 0.0) seeds_.push_back(largest);
  }
  std::deque<std::uint32_t> open;
  const auto take = [&](std::uint32_t i) {
    if (states_[i].is_reached) return;
    states_[i].is_reached = true;
    // Nothing goes on from what stands on a floor: a heap is no ramp.
    if (!states_[i].is_blocked && levels_[i].kind != FloorLevel::Kind::Clutter) open.push_back(i);
  };
  for (const std::uint32_t seed : seeds_) take(seed);
  while (!open.empty()) {
    const std::uint32_t i = open.front();
    open.pop_front();
    forNeighbours(cell_of_[i], 2, [&](std::size_t cell, double) {
      for (std::uint32_t k = levels_.begin(cell); k < levels_.end(cell); ++k)
        if (std::abs(levels_[k].height - levels_[i].height) <= robot_.max_step) take(k);
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
    if (levels_[i].kind != FloorLevel::Kind::Path &&
        isHollow(cell_of_[i], height, source_.resolution))
      states_[i].is_edge = true;
    forNeighbours(cell_of_[i], reach, [&](std::size_t cell, double distance) {
      const double tolerance = std::max(robot_.max_step, distance * raster_.cell * steepest);
      if (isBlocked(cell, height)) return;
      const auto next = levelNear(cell, height, tolerance);
      if (next && levels_[*next].kind != FloorLevel::Kind::Guessed) {
        if (levels_[*next].kind != FloorLevel::Kind::Path &&
            isHollow(cell, levels_[*next].height, source_.resolution))
          states_[i].is_edge = true;
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
  std::sort(heights.begin(), heights.end());
  std::vector<double> storeys;
  if (is_one) return {heights[heights.size() / 2]};
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
    heights.erase(std::remove_if(heights.begin(), heights.end(), is_near), heights.end());
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
  std::deque<std::uint32_t> open;
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
  while (!open.empty()) {
    const std::uint32_t cell = open.front();
    open.pop_front();
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
    std::nth_element(heights.begin(), heights.begin() + long(heights.size() / 2), heights.end());
    plan.floor = heights[heights.size() / 2];
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
  if (source_.floors.empty() && levels_.size() > 0)
    note += "; where floors were measured is not known, as in finished maps: plan before finishing";
  if (!source_.ground.empty())
    note += "; removed ground is free only below the path: keep the ground for a plan";
  if (source_.path.empty())
    note += "; the map has no path: the robot is taken to stand on the largest floor";
  return note;
}

}  // namespace planar_mapping::detail
