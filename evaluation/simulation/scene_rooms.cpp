// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "evaluation/simulation/scene_builder.h"

namespace planar_mapping::evaluation {
namespace {

const Material kWall{0xD9D2C3, Pattern::Speckles, 0.8, 0.4};
const Material kPartition{0xC3CBD0, Pattern::Speckles, 0.8, 0.3};
const Material kFloor{0x8E9396, Pattern::Tiles, 1.0};
const Material kCeiling{0xE6E6E2, Pattern::Tiles, 0.7};
const Material kWood{0x8A5A32, Pattern::Planks, 0.95};
const Material kCardboard{0xB98D56, Pattern::Speckles, 0.9};
const Material kFabric{0x3F6E8C, Pattern::Speckles, 1.0};

constexpr double kRoom = 4.0;  ///< side of each room, metres
constexpr double kPartitionWidth = 0.15;
constexpr double kHeight = 2.5;
constexpr double kThickness = 0.15;

struct Waypoint {
  double x, y, yaw_deg;
};

/// Through the first room, the doorway and the second room, looking at the north wall in both.
constexpr Waypoint kWay[] = {{0.7, 1.9, 65.0}, {1.5, 1.6, 40.0}, {2.6, 1.3, 5.0},  {4.1, 1.3, 0.0},
                             {5.4, 1.3, 20.0}, {6.4, 1.5, 70.0}, {6.9, 1.9, 110.0}};

double lengthOfWay() {
  double length = 0.0;
  for (std::size_t i = 1; i < std::size(kWay); ++i)
    length += std::hypot(kWay[i].x - kWay[i - 1].x, kWay[i].y - kWay[i - 1].y);
  return length;
}

Waypoint placeAt(double s) {
  double rest = s * lengthOfWay();
  for (std::size_t i = 1; i < std::size(kWay); ++i) {
    const Waypoint& a = kWay[i - 1];
    const Waypoint& b = kWay[i];
    const double piece = std::hypot(b.x - a.x, b.y - a.y);
    if (rest <= piece || i + 1 == std::size(kWay)) {
      const double t = std::min(1.0, rest / piece);
      return {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y),
              a.yaw_deg + t * (b.yaw_deg - a.yaw_deg)};
    }
    rest -= piece;
  }
  return kWay[0];
}

void addShell(SceneBuilder& b) {
  constexpr double kLength = 2.0 * kRoom + kPartitionWidth;
  b.box("floor", {-0.5, -0.5, -0.1}, {kLength + 1.0, kRoom + 1.0, 0.1}, kFloor);
  b.box("ceiling", {-0.5, -0.5, kHeight}, {kLength + 1.0, kRoom + 1.0, 0.1}, kCeiling);
  b.box("wall_north", {0, kRoom, 0}, {kLength, kThickness, kHeight}, kWall);
  b.box("wall_south", {0, -kThickness, 0}, {kLength, kThickness, kHeight}, kWall);
  b.box("wall_west", {-kThickness, 0, 0}, {kThickness, kRoom, kHeight}, kWall);
  b.box("wall_east", {kLength, 0, 0}, {kThickness, kRoom, kHeight}, kWall);
  b.moveTo(kRoom + kPartitionWidth, 0.0, 0.0, 90.0);
  b.wallWithOpening("partition", kRoom, kHeight, kPartitionWidth, 0.8, 1.8, 0.0, 2.05, kPartition);
}

void addTable(SceneBuilder& b, double x, double y, double yaw_deg) {
  b.moveTo(x, y, 0.0, yaw_deg);
  b.box("table_top", {-0.6, -0.35, 0.71}, {1.2, 0.7, 0.04}, kWood);
  for (const double leg_x : {-0.57, 0.5})
    for (const double leg_y : {-0.32, 0.25})
      b.box("table_leg", {leg_x, leg_y, 0}, {0.07, 0.07, 0.71}, kWood);
}

}  // namespace

void buildRooms(SceneBuilder& b) {
  addShell(b);
  addTable(b, 2.9, 0.5, 0.0);
  addTable(b, 7.3, 0.6, 90.0);
  b.moveTo(0.0, 0.0);
  b.box("cabinet", {2.6, 3.55, 0}, {0.9, 0.45, 1.1}, kWood);
  b.box("shelf", {5.2, 3.65, 0}, {1.1, 0.35, 1.8}, kWood);
  b.box("sofa_base", {0.05, 0.1, 0}, {1.6, 0.75, 0.4}, kFabric);
  b.box("sofa_back", {0.05, 0.0, 0.4}, {1.6, 0.2, 0.4}, kFabric);
  b.moveTo(3.5, 2.6, 0.0, 20.0);
  b.box("crate", {-0.25, -0.2, 0}, {0.5, 0.4, 0.4}, kCardboard);
  b.moveTo(4.6, 2.5, 0.0, -15.0);
  b.box("crate", {-0.2, -0.2, 0}, {0.4, 0.4, 0.5}, kCardboard);
  b.moveTo(7.4, 3.4, 0.0, 30.0);
  b.box("crate", {-0.25, -0.25, 0}, {0.5, 0.5, 0.6}, kCardboard);

  b.followLine(lengthOfWay(), [&b](double s, double turn_deg) {
    const Waypoint place = placeAt(s);
    b.lookFrom({place.x, place.y, 0.37}, place.yaw_deg + turn_deg, 0.0);
  });
  b.person(2.2, 2.9, b.params.frames / 4);
}

}  // namespace planar_mapping::evaluation
