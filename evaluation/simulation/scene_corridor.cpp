// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>

#include "evaluation/simulation/scene_builder.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping::evaluation {
namespace {

const Material kWall{0xDCD8CC, Pattern::Speckles, 0.7, 0.3};
const Material kFloor{0x8E9396, Pattern::Tiles, 1.0};
const Material kCeiling{0xE6E6E2, Pattern::Tiles, 0.7};
const Material kDoor{0x9C6B3C, Pattern::Planks, 0.9};
const Material kMetal{0xA9ADB0, Pattern::Plain, 0.5};
const Material kRed{0xC0392B, Pattern::Plain, 0.7};
const Material kCardboard{0xB98D56, Pattern::Speckles, 0.9};
const Material kWood{0xC9A26B, Pattern::Planks, 0.95};
const Material kFabric{0x44617B, Pattern::Speckles, 1.0};

constexpr double kLength = 16.0;
constexpr double kHalfWidth = 1.0;
constexpr double kHeight = 2.5;
constexpr double kThickness = 0.15;
constexpr double kSegment = 5.0;  ///< of a side of the long corridor

/// Adds what follows along a side of the corridor from \p begin on, its visible side at y = 0,
/// solid towards +y: the right side is turned by 180 degrees.
void moveToSide(SceneBuilder& b, bool left, double begin) {
  b.moveTo(begin, left ? kHalfWidth : -kHalfWidth, 0.0, left ? 0.0 : 180.0);
}

/// A wall between two x of the world with a door set back by the thickness of its frame.
void addDoorWall(SceneBuilder& b, bool left, double begin, double end, double door_begin,
                 bool open) {
  moveToSide(b, left, begin);
  const double length = std::abs(end - begin);
  b.wallWithOpening("wall", length, kHeight, kThickness, door_begin, door_begin + 0.95, 0.0, 2.1,
                    kWall);
  if (open) {
    b.turnedBox("door_leaf", {door_begin + 0.06, 0.15 + 0.45, 1.03}, {0.04, 0.9, 2.05},
                Eigen::AngleAxisd(0.12, Vector3::UnitZ()), kDoor);
    b.box("room_back", {door_begin - 1.4, 2.8, 0}, {3.6, kThickness, kHeight}, kWall);
    b.box("room_side", {door_begin - 1.4, kThickness, 0}, {kThickness, 2.65, kHeight}, kWall);
    b.box("room_side", {door_begin + 2.05, kThickness, 0}, {kThickness, 2.65, kHeight}, kWall);
    b.box("desk", {door_begin + 0.1, 2.0, 0.7}, {1.4, 0.7, 0.04}, kWood);
    b.box("desk_side", {door_begin + 0.1, 2.0, 0}, {0.04, 0.7, 0.7}, kWood);
    b.box("desk_side", {door_begin + 1.46, 2.0, 0}, {0.04, 0.7, 0.7}, kWood);
  } else {
    b.box("door_leaf", {door_begin, 0.08, 0}, {0.95, 0.05, 2.1}, kDoor);
    b.box("door_handle", {door_begin + 0.82, 0.02, 1.02}, {0.1, 0.06, 0.03}, kMetal);
  }
}

/// A stretch of wall with a niche of \p depth in it.
void addNicheWall(SceneBuilder& b, bool left, double begin, double end, double niche_begin,
                  double niche_end, double depth) {
  moveToSide(b, left, begin);
  const double length = std::abs(end - begin);
  b.wallWithOpening("wall", length, kHeight, depth, niche_begin, niche_end, 0.0, 2.2, kWall);
  b.box("niche_back", {niche_begin, depth, 0}, {niche_end - niche_begin, kThickness, kHeight},
        kWall);
}

/// Floor, ceiling and the walls at both ends.
void addShell(SceneBuilder& b, double length) {
  b.moveTo(0.0, 0.0);
  b.box("floor", {-2.0, -5.0, -0.1}, {length + 4.0, 10.0, 0.1}, kFloor);
  b.box("ceiling", {-2.0, -5.0, kHeight}, {length + 4.0, 10.0, 0.1}, kCeiling);
  b.box("wall_end", {length, -kHalfWidth, 0}, {kThickness, 2.0 * kHalfWidth, kHeight}, kWall);
  b.box("wall_start", {-1.15, -kHalfWidth, 0}, {kThickness, 2.0 * kHalfWidth, kHeight}, kWall);
}

/// One side of the long corridor between two x of the world: a door, a niche or plain wall.
void addSegment(SceneBuilder& b, double begin, double end, bool left, Random& random) {
  const double length = end - begin;
  const double from = left ? begin : end;
  const double to = left ? end : begin;
  const double kind = random.uniform();
  const double opening = random.uniform(1.6, length - 2.9);
  if (kind < 0.15 && length < 1.5 * kSegment) {
    addDoorWall(b, left, from, to, 1.9, true);
  } else if (kind < 0.7) {
    addDoorWall(b, left, from, to, opening, false);
  } else if (kind < 0.85) {
    addNicheWall(b, left, from, to, opening, opening + 1.2, 0.3);
  } else {
    moveToSide(b, left, from);
    b.box("wall", {0, 0, 0}, {length, kThickness, kHeight}, kWall);
  }
}

/// A thing beside the way, or nothing.
void addSideThing(SceneBuilder& b, double x, Random& random) {
  const double kind = random.uniform();
  const double side = random.uniform() < 0.5 ? -1.0 : 1.0;
  const double yaw_deg = random.uniform(-15.0, 15.0);
  if (kind < 0.25) {
    b.moveTo(x, 0.66 * side, 0.0, yaw_deg);
    b.box("carton", {-0.25, -0.2, 0}, {0.5, 0.4, 0.4}, kCardboard);
  } else if (kind < 0.4) {
    b.moveTo(x, 0.8 * side, 0.0, 0.0);
    b.cylinder("bin", {0, 0, 0}, 0.34, 0.6, kMetal);
  } else if (kind < 0.55) {
    b.moveTo(x, 0.81 * side, 0.0, 0.0);
    b.box("locker", {-0.25, -0.19, 0}, {0.5, 0.38, 1.5}, kMetal);
  } else if (kind < 0.65) {
    b.moveTo(x, 0.8 * side, 0.0, 0.0);
    b.box("bench_seat", {-0.55, -0.19, 0.42}, {1.1, 0.38, 0.05}, kWood);
    b.box("bench_side", {-0.55, -0.19, 0}, {0.05, 0.38, 0.42}, kWood);
    b.box("bench_side", {0.5, -0.19, 0}, {0.05, 0.38, 0.42}, kWood);
  }
}

/// A person who leaves before the camera comes, and a door across the way that opens.
void addMovingThings(SceneBuilder& b) {
  if (!b.params.moving) return;
  const auto frameAt = [&b](double x, double fraction) {
    return std::max(1,
                    b.frameWhen([x](const Vector3& camera) { return camera.x() > x; }, fraction));
  };
  b.person(4.3, 0.35, frameAt(1.8, 0.3));
  const int opens = frameAt(4.4, 0.6);
  b.moveTo(0.0, 0.0);
  b.box("fire_door", {6.9, -1.0, 0.01}, {0.05, 1.9, 2.1}, kDoor);
  b.onlyIn(1, 0, opens - 1);
  b.box("fire_door", {5.0, -0.98, 0.01}, {1.9, 0.05, 2.1}, kDoor);
  b.onlyIn(1, opens, std::numeric_limits<int>::max());
}

/// Of the length that is asked for.
void buildLongCorridor(SceneBuilder& b) {
  const double length = b.params.length;
  addShell(b, length);
  Random random;  // its own: which doors a corridor has must not depend on anything else
  for (const bool left : {true, false}) {
    for (double begin = -1.0; begin < length; begin += kSegment) {
      double end = begin + kSegment;
      if (length - end < 0.5 * kSegment) end = length;
      addSegment(b, begin, end, left, random);
      if (end == length) break;
    }
  }
  for (double x = 3.0; x < length - 3.0; x += 3.0) addSideThing(b, x, random);
  const double way = length - 4.5;
  b.followLine(way, [&b, way](double s, double turn_deg) {
    const double periods = way / 11.5;
    b.lookFrom({way * s, 0.12 * std::sin(4.0 * M_PI * periods * s), 0.37},
               14.0 * std::sin(6.0 * M_PI * periods * s) + turn_deg, 0.0);
  });
  addMovingThings(b);
}

}  // namespace

void buildCorridor(SceneBuilder& b) {
  if (b.params.length > 0.0) return buildLongCorridor(b);
  addShell(b, kLength);
  constexpr bool kLeft = true, kRight = false;
  addDoorWall(b, kLeft, -1.0, 4.0, 2.6, false);
  addDoorWall(b, kLeft, 4.0, 8.5, 2.2, true);
  addNicheWall(b, kLeft, 8.5, 12.0, 0.9, 2.4, 0.45);
  addDoorWall(b, kLeft, 12.0, kLength, 1.6, false);
  addNicheWall(b, kRight, 4.5, -1.0, 1.0, 1.8, 0.25);
  addDoorWall(b, kRight, 9.5, 4.5, 2.0, false);
  addDoorWall(b, kRight, kLength, 9.5, 3.4, true);

  b.moveTo(0.0, 0.0);
  b.cylinder("extinguisher", {3.1, -1.1, 0.25}, 0.16, 0.5, kRed);
  b.box("bench_seat", {9.6, 1.03, 0.42}, {1.1, 0.38, 0.05}, kWood);
  b.box("bench_side", {9.6, 1.03, 0}, {0.05, 0.38, 0.42}, kWood);
  b.box("bench_side", {10.65, 1.03, 0}, {0.05, 0.38, 0.42}, kWood);
  b.box("locker", {7.6, 0.62, 0}, {0.5, 0.38, 1.5}, kMetal);
  b.moveTo(5.4, -0.68, 0.0, 14.0);
  b.box("carton", {-0.25, -0.2, 0}, {0.5, 0.4, 0.35}, kCardboard);
  b.moveTo(5.42, -0.69, 0.35, -6.0);
  b.box("carton", {-0.18, -0.15, 0}, {0.34, 0.3, 0.25}, kCardboard);
  b.moveTo(12.4, 0.66, 0.0, -10.0);
  b.box("carton", {-0.3, -0.2, 0}, {0.6, 0.4, 0.5}, kCardboard);
  b.moveTo(14.6, -0.6, 0.0, 0.0);
  b.cylinder("bin", {0, 0, 0}, 0.34, 0.6, kMetal);
  b.moveTo(15.4, 0.35, 0.0, 0.0);
  b.box("armchair", {-0.3, -0.35, 0}, {0.6, 0.7, 0.4}, kFabric);
  b.box("armchair_back", {0.2, -0.35, 0.4}, {0.15, 0.7, 0.45}, kFabric);

  b.followLine(11.5, [&b](double s, double turn_deg) {
    b.lookFrom({11.5 * s, 0.12 * std::sin(4.0 * M_PI * s), 0.37},
               14.0 * std::sin(6.0 * M_PI * s) + turn_deg, 0.0);
  });
  addMovingThings(b);
}

}  // namespace planar_mapping::evaluation
