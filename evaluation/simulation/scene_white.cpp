// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "evaluation/simulation/scene_builder.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping::evaluation {
namespace {

const Material kWall{0xE4E2DC, Pattern::Plain, 0.0};
const Material kCeiling{0xECECEA, Pattern::Plain, 0.0};
const Material kFloor{0xA9794B, Pattern::Planks, 1.0};
const Material kBoard{0x8A6A4A, Pattern::Planks, 0.5};
const Material kFrame{0x2E3136, Pattern::Plain, 0.3};
const Material kPicture{0x7F8F9C, Pattern::Speckles, 1.0};
const Material kDoor{0xCFC4AE, Pattern::Plain, 0.15, 0.0, 0.25};
const Material kWood{0x8A5A32, Pattern::Planks, 0.95};
const Material kGlossy{0xB9B4AC, Pattern::Plain, 0.1, 0.0, 0.6};
const Material kCardboard{0xB98D56, Pattern::Speckles, 0.9};
const Material kLeaf{0x3F7D3A, Pattern::Speckles, 1.0};
const Material kClay{0xA5553A, Pattern::Speckles, 0.9};

constexpr double kHeight = 2.5;
constexpr double kThickness = 0.12;

/// The wall along local x from 0 to \p length, seen from -y, with what is on it.
void addWall(SceneBuilder& b, Random& random, double length, bool door) {
  b.box("wall", {-kThickness, 0, 0}, {length + 2 * kThickness, kThickness, kHeight}, kWall);
  const double board = random.uniform(0.06, 0.12);
  b.box("base_board", {0, -0.015, 0}, {length, 0.015, board}, kBoard);
  double x = random.uniform(0.3, 0.9);
  if (door) {
    b.box("door_frame", {x, -0.03, 0}, {0.96, 0.03, 2.06}, kFrame);
    b.box("door_leaf", {x + 0.04, -0.04, 0.01}, {0.88, 0.04, 2.0}, kDoor);
    x += 1.3;
  }
  while (true) {
    const double width = random.uniform(0.35, 0.7);
    const double height = random.uniform(0.3, 0.6);
    if (x + width > length - 0.3) return;
    const double z = random.uniform(1.2, 1.6);
    b.box("picture_frame", {x, -0.02, z}, {width, 0.02, height}, kFrame);
    b.box("picture", {x + 0.03, -0.022, z + 0.03}, {width - 0.06, 0.022, height - 0.06}, kPicture);
    x += width + random.uniform(0.5, 1.3);
  }
}

void addTable(SceneBuilder& b) {
  b.box("table_top", {-0.5, -0.35, 0.71}, {1.0, 0.7, 0.04}, kWood);
  for (const double x : {-0.47, 0.4})
    for (const double y : {-0.32, 0.25}) b.box("table_leg", {x, y, 0}, {0.07, 0.07, 0.71}, kWood);
  b.box("parcel", {-0.3, -0.1, 0.75}, {0.3, 0.22, 0.2}, kCardboard);
}

}  // namespace

void buildWhite(SceneBuilder& b) {
  Random random(b.params.seed);
  const double length = random.uniform(4.6, 5.6);
  const double width = random.uniform(3.9, 4.7);
  b.moveTo(-0.5 * length, -0.5 * width);
  b.box("floor", {-0.2, -0.2, -0.1}, {length + 0.4, width + 0.4, 0.1}, kFloor);
  b.box("ceiling", {-0.2, -0.2, kHeight}, {length + 0.4, width + 0.4, 0.1}, kCeiling);
  b.moveTo(-0.5 * length, 0.5 * width);
  addWall(b, random, length, false);
  b.moveTo(0.5 * length, 0.5 * width, 0.0, -90.0);
  addWall(b, random, width, true);
  b.moveTo(0.5 * length, -0.5 * width, 0.0, 180.0);
  addWall(b, random, length, false);
  b.moveTo(-0.5 * length, -0.5 * width, 0.0, 90.0);
  addWall(b, random, width, false);

  b.moveTo(random.uniform(-1.4, -0.4), -0.5 * width + 0.45, 0.0, random.uniform(-10.0, 10.0));
  addTable(b);
  b.moveTo(random.uniform(0.0, 0.8), 0.5 * width - 0.42);
  b.box("cabinet", {0, 0, 0}, {0.9, 0.4, random.uniform(0.8, 1.2)}, kGlossy);
  b.moveTo(0.5 * length - 0.5, -0.5 * width + 0.5, 0.0, random.uniform(0.0, 90.0));
  b.box("crate", {-0.25, -0.2, 0}, {0.5, 0.4, random.uniform(0.3, 0.6)}, kCardboard);
  b.moveTo(-0.5 * length, 0.5 * width);
  b.cylinder("plant_pot", {0.45, -0.45, 0}, 0.3, 0.3, kClay);
  b.sphere("plant", {0.45, -0.45, 0.6}, 0.55, kLeaf);
  b.scene.lamp = Vector3(random.uniform(-0.8, 0.8), random.uniform(-0.6, 0.6), 2.2);

  constexpr double kRadius = 0.4;
  b.moveTo(0.0, 0.0);
  b.followRound(2.0 * M_PI * kRadius, [&b](double s) {
    const double angle = 2.0 * M_PI * s;
    b.lookFrom({-kRadius * std::cos(angle), -kRadius * std::sin(angle), 1.0}, 360.0 * s,
               5.0 * std::cos(12.0 * M_PI * s));
  });
  b.person(0.9, 0.4, b.params.frames / 2);
}

}  // namespace planar_mapping::evaluation
