// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/baselines/standard_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping::evaluation {
namespace {

/// Calls visit(cell) for the cells of side \p s that the straight way from \p origin to \p end
/// crosses, in their order, without the one it ends in (Amanatides and Woo). Both points must be on
/// the lattice.
template <typename Visit>
void forEachCellOnRay(const Vector3& origin, const Vector3& end, double s, const Visit& visit) {
  GridCell cell;
  std::int32_t steps[3];  // left to do
  int direction[3];
  double next[3];  // fraction of the way at which the next border is crossed
  double per_cell[3];
  for (std::size_t k = 0; k < 3; ++k) {
    cell[k] = static_cast<std::int32_t>(std::floor(origin[k] / s));
    const auto last = static_cast<std::int32_t>(std::floor(end[k] / s));
    direction[k] = last > cell[k] ? 1 : -1;
    steps[k] = (last - cell[k]) * direction[k];
    const double way = std::abs(end[k] - origin[k]);
    const double border = static_cast<double>(cell[k] + (direction[k] > 0 ? 1 : 0)) * s;
    next[k] =
        steps[k] > 0 ? std::abs(border - origin[k]) / way : std::numeric_limits<double>::infinity();
    per_cell[k] = s / way;
  }
  while (steps[0] + steps[1] + steps[2] > 0) {
    visit(cell);
    std::size_t axis = 0;
    for (const std::size_t k : {std::size_t{1}, std::size_t{2}})
      if (next[k] < next[axis]) axis = k;
    cell[axis] += direction[axis];
    // Counted, so that rounding cannot lead past the end.
    next[axis] =
        --steps[axis] > 0 ? next[axis] + per_cell[axis] : std::numeric_limits<double>::infinity();
  }
}

constexpr float kHitLogOdds = 0.85f;
constexpr float kMissLogOdds = 0.405f;
constexpr float kMaxLogOdds = 3.5f;
constexpr std::size_t kGridHeaderBytes = 36;

}  // namespace

StandardGrid::StandardGrid(double s, int min_points) : side_(s) {
  requirePositive("s", s, "m");
  requireInRange("min_points", min_points, 1, 1e9);
  min_points_ = static_cast<std::uint32_t>(min_points);
}

StandardGrid::PointCount StandardGrid::count(const std::vector<Vector3>& points) const {
  PointCount points_of_cell;
  for (const Vector3& point : points) {
    std::uint64_t key = 0;
    if (planar_mapping::detail::cellKeyOf(point, side_, key)) ++points_of_cell[key];
  }
  return points_of_cell;
}

void StandardGrid::hit(const PointCount& points_of_cell) {
  for (std::size_t i = 0; i < points_of_cell.size(); ++i) {
    if (points_of_cell.value(i) < min_points_) continue;
    float& log_odds = log_odds_[points_of_cell.key(i)];
    log_odds = std::min(log_odds + kHitLogOdds, kMaxLogOdds);
  }
}

void StandardGrid::insert(const std::vector<Vector3>& world_points) {
  hit(count(world_points));
}

void StandardGrid::insert(const std::vector<Vector3>& obstacles, const std::vector<Vector3>& ground,
                          const Vector3& origin) {
  std::uint64_t origin_key = 0;
  if (!planar_mapping::detail::cellKeyOf(origin, side_, origin_key))
    throw InputError("the sensor is outside the lattice");
  const PointCount obstacle_points = count(obstacles);
  const PointCount ground_points = count(ground);
  std::vector<char> missed(log_odds_.size(), 0);
  for (const PointCount* ends : {&obstacle_points, &ground_points}) {
    for (const std::uint64_t end : ends->keys()) {
      const Vector3 middle = (planar_mapping::detail::cornerOf(end).array() + 0.5) * side_;
      forEachCellOnRay(origin, middle, side_, [&](const GridCell& cell) {
        const std::size_t at =
            log_odds_.indexOf(planar_mapping::detail::packKey({cell.x, cell.y, cell.z}));
        if (at != log_odds_.kNone) missed[at] = 1;
      });
    }
  }
  for (std::size_t i = 0; i < missed.size(); ++i) {
    if (missed[i] == 0) continue;
    const std::uint32_t* points = obstacle_points.find(log_odds_.key(i));
    if (points == nullptr || *points < min_points_) log_odds_.value(i) -= kMissLogOdds;
  }
  log_odds_.removeIf([](std::uint64_t, float log_odds) { return log_odds < 0.0f; });
  hit(obstacle_points);
}

std::vector<GridCell> StandardGrid::cells() const {
  std::vector<GridCell> cells;
  for (const std::uint64_t key : log_odds_.sortedKeys())
    cells.push_back(planar_mapping::detail::unpackKey(key));
  return cells;
}

std::vector<Cuboid> StandardGrid::cuboids() const {
  return cuboidsOf(cells(), side_);
}

std::size_t StandardGrid::memoryBytes() const {
  if (size() == 0) return 0;
  std::size_t slots = 64;
  while (3 * slots < 4 * size()) slots *= 2;
  return slots * (sizeof(std::uint64_t) + sizeof(float));
}

std::size_t StandardGrid::fileBytes() const {
  const std::vector<GridCell> all = cells();
  if (all.empty()) return kGridHeaderBytes;
  GridCell low = all.front();
  GridCell high = low;
  for (const GridCell& cell : all) {
    low = {std::min(low.x, cell.x), std::min(low.y, cell.y), std::min(low.z, cell.z)};
    high = {std::max(high.x, cell.x), std::max(high.y, cell.y), std::max(high.z, cell.z)};
  }
  const double volume = (high.x - low.x + 1.0) * (high.y - low.y + 1.0) * (high.z - low.z + 1.0);
  return kGridHeaderBytes +
         planar_mapping::detail::bytesOfBits(all.size(), planar_mapping::detail::bitsFor(volume));
}

Cuboid cuboidOf(const GridBox& box, double s) {
  Cuboid cuboid;
  cuboid.size = s * Vector3(box.size.x, box.size.y, box.size.z);
  cuboid.center = s * Vector3(box.low.x, box.low.y, box.low.z) + 0.5 * cuboid.size;
  return cuboid;
}

std::vector<Cuboid> cuboidsOf(const std::vector<GridCell>& cells, double s) {
  std::vector<Cuboid> cuboids;
  cuboids.reserve(cells.size());
  for (const GridCell& cell : cells) cuboids.push_back(cuboidOf({cell, {1, 1, 1}}, s));
  return cuboids;
}

std::vector<Cuboid> cuboidsOf(const std::vector<GridBox>& boxes, double s) {
  std::vector<Cuboid> cuboids;
  cuboids.reserve(boxes.size());
  for (const GridBox& box : boxes) cuboids.push_back(cuboidOf(box, s));
  return cuboids;
}

}  // namespace planar_mapping::evaluation
