// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>

#include "evaluation/simulation/scene_builder.h"

namespace planar_mapping::evaluation {
namespace {

const Material kPaving{0x9A968D, Pattern::Tiles, 1.0};
const Material kBrick{0x9E5A44, Pattern::Bricks, 1.0};
const Material kPlaster{0xD8CDB4, Pattern::Speckles, 0.75, 0.15};
const Material kStone{0xB5B0A4, Pattern::Speckles, 1.0};
const Material kBark{0x6B4A2F, Pattern::Speckles, 1.0};
const Material kLeaf{0x4C8A3F, Pattern::Speckles, 1.0};
const Material kIron{0x3A3D40, Pattern::Plain, 0.6};
const Material kWood{0xA9794B, Pattern::Planks, 1.0};
const Material kDoor{0x47624F, Pattern::Planks, 0.9};
const Material kCardboard{0xB98D56, Pattern::Speckles, 0.9};
const Material kSign{0xD9D9D2, Pattern::Tiles, 1.0};

void addTree(SceneBuilder& b, double x, double y, double diameter) {
  b.moveTo(x, y);
  b.cylinder("trunk", {0, 0, 0}, diameter, 2.6, kBark);
  b.sphere("crown", {0, 0, 3.4}, 2.4, kLeaf);
}

/// Things that stand somewhere else in the second half of the frames; a person who leaves.
void addMovedThings(SceneBuilder& b) {
  const int half = std::max(1, b.params.frames / 2);
  constexpr int kAlways = std::numeric_limits<int>::max();
  const auto carton = [&b](double x, double y) {
    b.moveTo(x, y, 0.0, 17.0);
    b.box("carton", {-0.3, -0.25, 0}, {0.6, 0.5, 0.55}, kCardboard);
  };
  carton(11.2, -1.7);
  b.onlyIn(1, 0, half - 1);
  carton(19.0, 1.3);
  b.onlyIn(1, half, kAlways);
  const auto sign = [&b](double x, double y) {
    b.moveTo(x, y, 0.0, 8.0);
    b.box("sign", {-0.03, -0.4, 0.02}, {0.06, 0.8, 1.0}, kSign);
  };
  sign(7.0, 1.6);
  b.onlyIn(1, 0, half - 1);
  sign(16.5, -1.5);
  b.onlyIn(1, half, kAlways);
  b.person(6.0, -0.6, b.frameWhen([](const Vector3& camera) { return camera.x() > 3.0; }, 0.4));
}

}  // namespace

void buildOutdoor(SceneBuilder& b) {
  b.box("ground", {-5, -10, -0.2}, {45, 20, 0.2}, kPaving);

  // North: a building with a recessed door and window sills; south: a low wall and a far house.
  b.moveTo(0.0, 5.0);
  b.wallWithOpening("building", 18.0, 5.0, 0.4, 7.0, 8.6, 0.0, 2.4, kBrick);
  b.box("building_door", {7.0, 0.3, 0}, {1.6, 0.1, 2.4}, kDoor);
  for (const double x : {2.0, 4.6, 11.0, 14.5})
    b.box("window_sill", {x, -0.15, 0.9}, {1.4, 0.15, 0.08}, kStone);
  b.box("building_corner", {18.0, -1.5, 0}, {0.4, 1.9, 5.0}, kBrick);
  b.moveTo(0.0, -5.0);
  b.box("low_wall", {0, -0.4, 0}, {14.0, 0.4, 1.1}, kStone);
  b.box("house", {20.0, -1.0, 0}, {10.0, 1.0, 4.5}, kPlaster);
  b.moveTo(30.0, -5.0);
  b.box("wall_end", {0, 0, 0}, {0.4, 10.4, 3.0}, kPlaster);

  b.moveTo(20.0, 2.6);
  for (int step = 0; step < 5; ++step)
    b.box("step", {0.0, 0.32 * step, 0.0}, {4.0, 2.4 - 0.32 * step, 0.16 * (step + 1)}, kStone);
  b.box("stair_cheek", {-0.3, 0, 0}, {0.3, 2.4, 1.0}, kStone);
  b.box("stair_cheek", {4.0, 0, 0}, {0.3, 2.4, 1.0}, kStone);
  b.moveTo(25.2, 2.5, 0.0, 0.0);
  b.turnedBox("ramp", {1.8, 1.0, 0.2}, {3.4, 1.6, 0.08}, Eigen::AngleAxisd(-0.14, Vector3::UnitY()),
              kStone);

  addTree(b, 4.0, -3.2, 0.36);
  addTree(b, 9.5, -3.5, 0.44);
  addTree(b, 15.5, -3.0, 0.3);
  addTree(b, 13.0, 3.4, 0.4);
  for (const double x : {17.0, 19.6, 22.2, 24.8}) {
    b.moveTo(x, -2.6);
    b.box("column_foot", {-0.35, -0.35, 0}, {0.7, 0.7, 0.2}, kStone);
    b.cylinder("column", {0, 0, 0.2}, 0.5, 3.0, kStone);
  }
  for (int i = 0; i < 6; ++i) {
    b.moveTo(2.0 + 2.2 * i, 2.3);
    b.box("pillar", {-0.05, -0.05, 0}, {0.1, 0.1, 1.0}, kIron);
  }
  b.moveTo(6.2, -4.3, 0.0, 4.0);
  b.box("bench_seat", {0, 0, 0.42}, {1.8, 0.45, 0.06}, kWood);
  b.box("bench_back", {0, -0.05, 0.48}, {1.8, 0.05, 0.45}, kWood);
  b.box("bench_foot", {0.1, 0, 0}, {0.12, 0.45, 0.42}, kStone);
  b.box("bench_foot", {1.58, 0, 0}, {0.12, 0.45, 0.42}, kStone);
  b.moveTo(14.8, 1.7, 0.0, 30.0);
  b.box("planter", {-0.6, -0.3, 0}, {1.2, 0.6, 0.5}, kStone);

  b.followLine(24.0, [&b](double s, double turn_deg) {
    b.lookFrom({0.5 + 24.0 * s, 0.5 * std::sin(2.0 * M_PI * s), 0.37},
               25.0 * std::sin(6.0 * M_PI * s) + turn_deg, 4.0);
  });
  addMovedThings(b);
}

}  // namespace planar_mapping::evaluation
