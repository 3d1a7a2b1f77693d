// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "evaluation/simulation/scene_builder.h"

namespace planar_mapping::evaluation {
namespace {

const Material kWall{0xD9D2C3, Pattern::Speckles, 0.75, 0.35};
const Material kSkirting{0xF2EEE6, Pattern::Plain, 0.6};
const Material kFloor{0xA9794B, Pattern::Planks, 1.0};
const Material kWood{0x8A5A32, Pattern::Planks, 0.95};
const Material kPaleWood{0xC9A26B, Pattern::Planks, 0.95};
const Material kWhite{0xE8E8E4, Pattern::Plain, 0.45};
const Material kFabric{0x3F6E8C, Pattern::Speckles, 1.0};
const Material kCushion{0xC8663F, Pattern::Speckles, 1.0};
const Material kCardboard{0xB98D56, Pattern::Speckles, 0.9};
const Material kDark{0x2E3136, Pattern::Plain, 0.6};
const Material kLeaf{0x3F7D3A, Pattern::Speckles, 1.0};
const Material kClay{0xA5553A, Pattern::Speckles, 0.9};
const Material kBall{0xD03A2F, Pattern::Speckles, 0.9};

constexpr double kLength = 6.0;
constexpr double kWidth = 4.8;
constexpr double kHeight = 2.5;
constexpr double kThickness = 0.12;

void addShell(SceneBuilder& b) {
  b.moveTo(-0.5 * kLength, -0.5 * kWidth);
  b.box("floor", {-1.5, -0.5, -0.1}, {kLength + 3.0, kWidth + 3.0, 0.1}, kFloor);
  b.box("wall_west", {-kThickness, 0, 0}, {kThickness, kWidth, kHeight}, kWall);
  b.box("wall_south", {0, -kThickness, 0}, {kLength, kThickness, kHeight}, kWall);
  b.moveTo(-0.5 * kLength, 0.5 * kWidth);
  b.wallWithOpening("wall_north", kLength, kHeight, kThickness, 0.9, 1.85, 0.0, 2.05, kWall);
  b.box("hall_wall", {-1.0, 1.4, 0}, {5.0, kThickness, kHeight}, kWall);
  b.moveTo(0.5 * kLength, 0.5 * kWidth, 0.0, -90.0);
  b.wallWithOpening("wall_east", kWidth, kHeight, kThickness, 1.4, 3.2, 0.95, 2.1, kWall);
  b.box("window_sill", {1.3, -0.16, 0.91}, {2.0, 0.2, 0.04}, kWhite);
  b.box("radiator", {1.5, -0.11, 0.15}, {1.6, 0.09, 0.6}, kWhite);

  b.moveTo(-0.5 * kLength + 1.85, 0.5 * kWidth, 0.0, -62.0);
  b.box("door_leaf", {0.0, -0.02, 0.01}, {0.93, 0.04, 2.02}, kPaleWood);
  b.moveTo(-0.5 * kLength, -0.5 * kWidth);
  b.box("skirting_south", {0, 0, 0}, {kLength, 0.015, 0.09}, kSkirting);
  b.box("skirting_west", {0, 0, 0}, {0.015, kWidth, 0.09}, kSkirting);
}

void addTable(SceneBuilder& b) {
  b.moveTo(1.75, -1.25, 0.0, 12.0);
  b.box("table_top", {-0.75, -0.42, 0.71}, {1.5, 0.84, 0.04}, kWood);
  for (const double x : {-0.70, 0.63})
    for (const double y : {-0.38, 0.31}) b.box("table_leg", {x, y, 0}, {0.07, 0.07, 0.71}, kWood);
  b.box("laptop", {-0.15, -0.2, 0.75}, {0.34, 0.24, 0.02}, kDark);
  b.turnedBox("laptop_screen", {0.02, 0.075, 0.87}, {0.34, 0.015, 0.23},
              Eigen::AngleAxisd(-0.25, Vector3::UnitX()), kDark);
  b.box("parcel", {-0.62, 0.0, 0.75}, {0.3, 0.22, 0.2}, kCardboard);
  b.cylinder("vase", {0.55, 0.15, 0.75}, 0.13, 0.26, kClay);
  b.sphere("bouquet", {0.55, 0.15, 1.1}, 0.24, kLeaf);
}

void addChair(SceneBuilder& b, double x, double y, double yaw_deg) {
  b.moveTo(x, y, 0.0, yaw_deg);
  b.box("chair_seat", {-0.22, -0.22, 0.43}, {0.44, 0.44, 0.04}, kPaleWood);
  for (const double lx : {-0.22, 0.18})
    for (const double ly : {-0.22, 0.18})
      b.box("chair_leg", {lx, ly, 0}, {0.04, 0.04, 0.43}, kPaleWood);
  b.turnedBox("chair_back", {0, 0.245, 0.72}, {0.42, 0.03, 0.5},
              Eigen::AngleAxisd(-0.14, Vector3::UnitX()), kPaleWood);
}

void addShelf(SceneBuilder& b) {
  // Against the south wall, open to the north.
  b.moveTo(-1.9, -0.5 * kWidth + 0.02);
  b.box("shelf_back", {0, 0, 0}, {1.2, 0.02, 1.9}, kWood);
  b.box("shelf_side", {0, 0.02, 0}, {0.03, 0.3, 1.9}, kWood);
  b.box("shelf_side", {1.17, 0.02, 0}, {0.03, 0.3, 1.9}, kWood);
  const Material books[] = {{0x7B2D26, Pattern::Speckles, 1.0},
                            {0x2F4858, Pattern::Speckles, 1.0},
                            {0xC9B458, Pattern::Speckles, 1.0},
                            {0x4F6D4A, Pattern::Speckles, 1.0}};
  for (int board = 0; board < 5; ++board) {
    const double z = 0.06 + 0.45 * board;
    b.box("shelf_board", {0.03, 0.02, z}, {1.14, 0.3, 0.03}, kWood);
    if (board == 4) continue;
    double x = 0.05;
    for (int i = 0; i < 5 + board; ++i) {
      const double width = 0.05 + 0.012 * ((3 * i + 5 * board) % 5);
      const double height = 0.24 + 0.03 * ((2 * i + board) % 4);
      b.box("book", {x, 0.05, z + 0.03}, {width, 0.2 + 0.01 * (i % 3), height},
            books[static_cast<std::size_t>(i + board) % 4]);
      x += width + 0.002;
    }
  }
}

void addSofa(SceneBuilder& b) {
  // Against the west wall, facing east.
  b.moveTo(-0.5 * kLength + 0.05, 1.35, 0.0, -90.0);
  b.box("sofa_base", {0.0, 0.0, 0.05}, {1.9, 0.85, 0.22}, kFabric);
  b.box("sofa_seat", {0.2, 0.2, 0.27}, {1.5, 0.62, 0.16}, kFabric);
  b.box("sofa_back", {0.0, 0.0, 0.27}, {1.9, 0.2, 0.55}, kFabric);
  b.box("sofa_arm", {0.0, 0.2, 0.27}, {0.2, 0.65, 0.33}, kFabric);
  b.box("sofa_arm", {1.7, 0.2, 0.27}, {0.2, 0.65, 0.33}, kFabric);
  b.turnedBox("cushion", {0.5, 0.32, 0.62}, {0.42, 0.13, 0.4},
              Eigen::AngleAxisd(0.35, Vector3::UnitX()), kCushion);
  b.moveTo(-1.55, 0.55, 0.0, 8.0);
  b.cylinder("stool", {0, 0, 0}, 0.42, 0.38, kPaleWood);
}

void addCornerThings(SceneBuilder& b) {
  b.moveTo(0.55, 0.5 * kWidth - 0.47);
  b.box("cabinet", {0, 0, 0.06}, {1.25, 0.45, 0.98}, kPaleWood);
  b.box("cabinet_top", {-0.02, -0.02, 1.04}, {1.29, 0.47, 0.03}, kWood);
  b.box("cabinet_door", {0.02, -0.015, 0.1}, {0.59, 0.015, 0.9}, kWhite);
  b.box("cabinet_door", {0.64, -0.015, 0.1}, {0.59, 0.015, 0.9}, kWhite);
  b.box("television", {0.15, 0.15, 1.1}, {0.95, 0.05, 0.55}, kDark);
  b.moveTo(2.45, 1.75, 0.0, 25.0);
  b.box("crate", {-0.3, -0.3, 0}, {0.6, 0.55, 0.42}, kCardboard);
  b.moveTo(2.43, 1.8, 0.42, -8.0);
  b.box("crate_small", {-0.22, -0.2, 0}, {0.42, 0.36, 0.3}, kCardboard);
  b.moveTo(-0.35, -1.95, 0.0, -20.0);
  b.box("parcel_on_floor", {-0.2, -0.15, 0}, {0.45, 0.35, 0.3}, kCardboard);
  // A board that leans against the south wall, 20 degrees from upright.
  b.moveTo(0.7, -0.5 * kWidth);
  b.turnedBox("leaning_board", {0, 0.315, 0.69}, {0.55, 0.03, 1.4},
              Eigen::AngleAxisd(20.0 * M_PI / 180.0, Vector3::UnitX()), kPaleWood);
  b.moveTo(0.0, 0.0);
  b.sphere("ball", {0.1, 1.75, 0.15}, 0.3, kBall);
  b.cylinder("plant_pot", {-2.6, -1.95, 0}, 0.34, 0.34, kClay);
  b.sphere("plant", {-2.6, -1.95, 0.63}, 0.62, kLeaf);
}

}  // namespace

void buildRoom(SceneBuilder& b) {
  addShell(b);
  addTable(b);
  addChair(b, 1.55, -0.48, 22.0);
  addChair(b, 2.35, -0.3, -38.0);
  addShelf(b);
  addSofa(b);
  addCornerThings(b);
  // Once around, at the height a person carries a camera, looking outwards, in turn at the walls
  // and at the floor.
  constexpr double kRadius = 0.35;
  b.followRound(2.0 * M_PI * kRadius, [&b](double s) {
    const double angle = 2.0 * M_PI * s;
    b.lookFrom({-0.1 - kRadius * std::cos(angle), 0.1 - kRadius * std::sin(angle), 1.25}, 360.0 * s,
               -18.0 + 10.0 * std::cos(12.0 * M_PI * s));
  });
  b.person(1.9, 0.55, b.params.frames / 2);
}

}  // namespace planar_mapping::evaluation
