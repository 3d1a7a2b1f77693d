// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "planar_mapping/map/integration/map_join.h"
#include "planar_mapping/map/integration/placed_cells.h"
#include "planar_mapping/map/store/belief.h"

namespace planar_mapping::detail {
namespace {

constexpr double kSide = 0.1;
constexpr double kRadius = 1.03;  // of the ball

MapData cluttered(const std::vector<Vector3>& points) {
  MapData map;
  map.params.unknown_space = false;
  for (const Vector3& point : points) addPart(point, kSide, kCertain, true, map.cells);
  map.commit();
  return map;
}

MapData ball() {
  std::vector<Vector3> points;
  constexpr double kStep = 0.02;  // radians
  for (double polar = 0.0; polar <= M_PI; polar += kStep) {
    for (double turn = 0.0; turn < 2.0 * M_PI; turn += kStep)
      points.emplace_back(kRadius * Vector3(std::sin(polar) * std::cos(turn),
                                            std::sin(polar) * std::sin(turn), std::cos(polar)));
  }
  return cluttered(points);
}

Pose turned(double angle) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(angle, Vector3(0.3, 0.2, 0.93).normalized()).toRotationMatrix();
  pose.translation() = Vector3(0.537, -0.412, 0.163);
  return pose;
}

std::size_t cellsOf(const MapData& map) {
  std::size_t count = 0;
  map.cells.forEachBlock([&](const Int3&, const CellBlock& block) {
    count += static_cast<std::size_t>(__builtin_popcountll(block.occupied()));
    forEachBit(block.occupied(), [&](std::size_t bit) { EXPECT_NE(block.octants(bit), 0); });
  });
  return count;
}

bool isOccupied(const MapData& map, const Int3& cell) {
  const CellBlock* block = map.cells.find(CellLayer::blockOf(cell));
  return block != nullptr && (block->occupied() >> CellLayer::bitOf(cell) & 1u) != 0;
}

/// Does a way from face to face of empty cells lead out of the ball?
bool leaks(const MapData& map, const Vector3& centre) {
  KeyMap<std::uint8_t> seen;
  std::vector<Int3> open = {toInt3((centre / kSide).array().floor())};
  const Int3 start = open.front();
  seen.insert(packKey(start));
  constexpr std::int32_t kFar = 14;  // cells
  while (!open.empty()) {
    const Int3 at = open.back();
    open.pop_back();
    if (std::max({std::abs(at.x - start.x), std::abs(at.y - start.y), std::abs(at.z - start.z)}) >
        kFar)
      return true;
    for (int side = 0; side < 6; ++side) {
      Int3 next = at;
      next[static_cast<std::size_t>(side / 2)] += side % 2 == 0 ? 1 : -1;
      if (isOccupied(map, next) || seen.find(packKey(next)) != nullptr) continue;
      seen.insert(packKey(next));
      open.push_back(next);
    }
  }
  return false;
}

TEST(PlacedMap, ClutterKeepsItsNumberOfCells) {
  const MapData map = ball();
  const auto before = static_cast<double>(cellsOf(map));
  for (const double angle : {0.0, 0.005, 0.02, 0.05, 0.1, 0.2, -0.1})
    EXPECT_NEAR(static_cast<double>(cellsOf(placedMap(map, turned(angle)))), before, 0.02 * before)
        << angle;
  for (const double angle : {0.4, 0.8, 1.2, 2.0})
    EXPECT_NEAR(static_cast<double>(cellsOf(placedMap(map, turned(angle)))), before, 0.08 * before)
        << angle;
}

TEST(PlacedMap, ATurnedSurfaceHasNoHole) {
  const MapData map = ball();
  EXPECT_FALSE(leaks(map, Vector3::Zero()));
  for (double angle = 0.0; angle < 1.6; angle += 0.05) {
    const Pose T = turned(angle);
    EXPECT_FALSE(leaks(placedMap(map, T), T.translation())) << angle;
  }
}

TEST(PlacedMap, PointsOfClutterMoveByLessThanHalfACell) {
  const MapData map = ball();
  const Pose T = turned(0.3);
  double farthest = 0.0;
  const MapData placed = placedMap(map, T);
  placed.cells.forEachBlock([&](const Int3& at, const CellBlock& block) {
    forEachBit(block.occupied(), [&](std::size_t bit) {
      forEachPartOf(placed, block, bit, CellLayer::cellOf(at, static_cast<int>(bit)),
                    [&](const Vector3& part) {
                      const double r = (kSide * part - T.translation()).norm();
                      farthest = std::max(farthest, std::abs(r - kRadius));
                    });
    });
  });
  // And half the diagonal of an eighth, before and after.
  EXPECT_LT(farthest, 0.5 * kSide + 0.5 * std::sqrt(3.0) * kSide);
}

TEST(PlacedMap, ALoneCellIsNotLost) {
  for (double angle = 0.0; angle < 1.6; angle += 0.01) {
    const MapData placed = placedMap(cluttered({Vector3(0.512, -0.23, 0.71)}), turned(angle));
    EXPECT_GE(cellsOf(placed), 1u) << angle;
  }
}

}  // namespace
}  // namespace planar_mapping::detail
