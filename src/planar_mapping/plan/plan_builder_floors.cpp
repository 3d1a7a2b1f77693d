// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Where floors were measured, and where the robot stood on them.
#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_mapping/base/disjoint_parts.h"
#include "planar_mapping/geometry/oriented_box.h"
#include "planar_mapping/plan/plan_builder.h"

namespace planar_mapping::detail {
namespace {

/// Of a sensor over the floor: a person holds a camera up to here, metres.
constexpr double kMaxCameraHeight = 2.5;
/// From a place of the path to the nearest floor that was seen: what cameras do not see of the
/// floor before them, metres.
constexpr double kBlindReach = 5.0;
/// Between two places of the path the robot went straight, metres.
constexpr double kMaxStride = 2.0;

}  // namespace

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
  if (source_.path.empty()) return;
  markParts();
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
  if (!floors.empty()) sortLevels();
  for (const auto& [cell, height] : stood)
    if (const auto level = levelNear(cell, height, robot_.max_step)) seeds_.push_back(*level);
  for (std::uint32_t i = 0; i < levels_.size(); ++i)
    if (levels_[i].kind == FloorLevel::Kind::Path) seeds_.push_back(i);
}

}  // namespace planar_mapping::detail
