// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/standard_grid.h"

#include <algorithm>
#include <cmath>

#include "baselines/packed_bits.h"
#include "planar_mapping/core/base/error.h"
#include "baselines/ray_cells.h"

namespace planar_mapping {
namespace evaluation {
namespace {

constexpr float kHitLogOdds = 0.85f;
constexpr float kMissLogOdds = 0.405f;
constexpr float kMostLogOdds = 3.5f;
constexpr std::size_t kHeaderBytes = 36;

std::uint64_t keyOf(const GridCell& cell) {
  return detail::packCell(cell.x, cell.y, cell.z);
}

bool isOnLattice(const GridCell& cell) {
  const auto fits = [](std::int32_t v) {
    return v >= -detail::kCellLimit && v < detail::kCellLimit;
  };
  return fits(cell.x) && fits(cell.y) && fits(cell.z);
}

}  // namespace

StandardGrid::StandardGrid(double s, int min_points) : side_(s) {
  requirePositive("s", s, "m");
  requireInRange("min_points", min_points, 1, 1e9);
  min_points_ = static_cast<std::uint32_t>(min_points);
}

StandardGrid::PointCount StandardGrid::count(const std::vector<Vector3>& points) {
  PointCount points_of_cell;
  for (const Vector3& point : points) {
    std::uint64_t key = 0;
    if (detail::cellKeyOf(point, side_, key)) {
      ++points_of_cell[key];
    } else {
      ++dropped_;
    }
  }
  return points_of_cell;
}

void StandardGrid::hit(const PointCount& points_of_cell) {
  points_of_cell.forEach([this](std::uint64_t key, std::uint32_t points) {
    if (points < min_points_) return;
    float& log_odds = log_odds_[key];
    log_odds = std::min(log_odds + kHitLogOdds, kMostLogOdds);
  });
}

void StandardGrid::insert(const std::vector<Vector3>& world_points) {
  hit(count(world_points));
}

void StandardGrid::insert(const std::vector<Vector3>& obstacles, const std::vector<Vector3>& ground,
                          const Vector3& origin) {
  std::uint64_t origin_key = 0;
  if (!detail::cellKeyOf(origin, side_, origin_key))
    throw InputError("the sensor is outside the lattice");
  const PointCount obstacle_points = count(obstacles);
  const PointCount ground_points = count(ground);
  detail::CellTable<char> missed;
  const auto clear = [&](std::uint64_t end_key, std::uint32_t) {
    Vector3 end;
    for (int axis = 0; axis < 3; ++axis)
      end[axis] = (detail::unpackCell(end_key, axis) + 0.5) * side_;
    forEachCellOnRay(origin, end, side_, [&](std::int64_t x, std::int64_t y, std::int64_t z) {
      const std::uint64_t key = detail::packCell(x, y, z);
      if (log_odds_.find(key) != nullptr) missed[key] = 1;
    });
  };
  obstacle_points.forEach(clear);
  ground_points.forEach(clear);
  missed.forEach([&](std::uint64_t key, char) {
    const std::uint32_t* points = obstacle_points.find(key);
    if (points == nullptr || *points < min_points_) *log_odds_.find(key) -= kMissLogOdds;
  });
  log_odds_.removeIf([](std::uint64_t, float log_odds) { return log_odds < 0.0f; });
  hit(obstacle_points);
}

std::vector<GridCell> StandardGrid::cells() const {
  std::vector<std::uint64_t> keys;
  keys.reserve(size());
  log_odds_.forEach([&keys](std::uint64_t key, float) { keys.push_back(key); });
  std::sort(keys.begin(), keys.end());
  std::vector<GridCell> cells;
  cells.reserve(keys.size());
  for (const std::uint64_t key : keys) {
    cells.push_back(
        {detail::unpackCell(key, 0), detail::unpackCell(key, 1), detail::unpackCell(key, 2)});
  }
  return cells;
}

std::vector<Cuboid> StandardGrid::cuboids() const {
  return cuboidsOf(cells(), side_);
}

double StandardGrid::occupancy(const GridCell& cell) const {
  const float* log_odds = isOnLattice(cell) ? log_odds_.find(keyOf(cell)) : nullptr;
  return log_odds == nullptr ? 0.5 : 1.0 / (1.0 + std::exp(-static_cast<double>(*log_odds)));
}

std::size_t StandardGrid::memoryBytes() const {
  return log_odds_.memoryBytes();
}

std::size_t StandardGrid::fileBytes() const {
  const std::vector<GridCell> all = cells();
  if (all.empty()) return kHeaderBytes;
  GridCell low = all.front();
  GridCell high = low;
  for (const GridCell& cell : all) {
    low = {std::min(low.x, cell.x), std::min(low.y, cell.y), std::min(low.z, cell.z)};
    high = {std::max(high.x, cell.x), std::max(high.y, cell.y), std::max(high.z, cell.z)};
  }
  const double volume = (high.x - low.x + 1.0) * (high.y - low.y + 1.0) * (high.z - low.z + 1.0);
  return kHeaderBytes + bytesOfBits(all.size(), bitsFor(volume));
}

}  // namespace evaluation
}  // namespace planar_mapping
