// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <vector>

#include "evaluation/simulation/scene_builder.h"

namespace planar_mapping::evaluation {
namespace {

// Rooms lie on both sides of a hall along x; stairs are at its end. Metres.
constexpr double kRoomLength = 5.0;  // along the hall
constexpr double kRoomDepth = 4.0;
constexpr double kHall = 2.0;
constexpr double kHeight = 2.6;
constexpr double kStorey = 3.0;
constexpr double kWallWidth = 0.15;
constexpr double kStairwell = 7.0;
constexpr int kSteps = 15;
constexpr double kEyes = 1.2;               // above the floor
constexpr double kTurnPerMetre = 90.0;      // degrees turned in the time of a metre
constexpr double kUsualStep = 0.15;         // between frames
constexpr std::uint64_t kWalks = 1u << 16;  // random streams of the walks; those below are of rooms

const Material kTread{0x7D8287, Pattern::Speckles, 1.0};
const Material kSlab{0x8E9396, Pattern::Tiles, 1.0};

/// A building of so many storeys and rooms a storey.
struct Building {
  explicit Building(const SceneParams& params)
      : floors(params.floors), a_side((params.rooms + 1) / 2), seed(params.seed) {}
  double length() const { return kRoomLength * a_side; }

  int floors;
  int a_side;  ///< rooms
  std::uint64_t seed;
};

Material wallOf(Random& random) {
  const auto shade = [&random]() { return static_cast<std::uint32_t>(150 + random.below(90)); };
  return {shade() << 16u | shade() << 8u | shade(), Pattern::Speckles, 0.9, 0.5};
}

void addRoom(SceneBuilder& b, double x, double z, bool is_north, Random& random) {
  const Material wall = wallOf(random);
  const double y = is_north ? kHall : -kWallWidth;
  b.moveTo(x, y, z);
  b.wallWithOpening("door_wall", kRoomLength, kHeight, kWallWidth, 2.0, 2.9, 0.0, 2.05, wall);
  b.moveTo(x, is_north ? kHall + kWallWidth : -kWallWidth - kRoomDepth, z);
  b.box("side_wall", {-0.5 * kWallWidth, 0, 0}, {kWallWidth, kRoomDepth, kHeight}, wall);
  const double outer = is_north ? kRoomDepth : -kWallWidth;
  b.box("outer_wall", {0, outer, 0}, {kRoomLength, kWallWidth, kHeight}, wall);
  for (int i = 0; i < 4; ++i) {  // along the outer wall, the way in is free
    const Vector3 size(0.4 + 0.7 * random.uniform(), 0.4 + 0.4 * random.uniform(),
                       0.3 + 1.4 * random.uniform());
    const double back = is_north ? kRoomDepth - size.y() - 0.05 : 0.05;
    b.box("furniture", {0.15 + 1.2 * i + 0.1 * random.uniform(), back, 0}, size, wallOf(random));
  }
}

void addStorey(SceneBuilder& b, const Building& building, int floor) {
  const double length = building.length();
  const double z = kStorey * floor;
  const double depth = kRoomDepth + kWallWidth;
  const double below = kStorey - kHeight;
  b.moveTo(0, 0, z);
  b.box("slab", {-1, -depth - 1, -below}, {length + 1, kHall + 2 * depth + 2, below}, kSlab);
  b.box("hall_end", {-kWallWidth, 0, 0}, {kWallWidth, kHall, kHeight}, kTread);
  for (int i = 0; i < 2 * building.a_side; ++i) {
    Random random(building.seed, static_cast<std::uint64_t>(2 * building.a_side * floor + i));
    addRoom(b, kRoomLength * (i / 2), z, i % 2 == 1, random);
  }
  b.moveTo(length, 0, z);
  for (const double y : {-depth, kHall})
    b.box("end_wall", {-0.5 * kWallWidth, y, 0}, {kWallWidth, depth, kHeight}, kTread);
  // The way beside the flight, and where it ends.
  b.box("walkway", {0, 0.5 * kHall, -below}, {kStairwell, 0.5 * kHall, below}, kSlab);
  b.box("landing", {kStairwell - 1, 0, -below}, {1, 0.5 * kHall, below}, kSlab);
  const double solid = floor == 0 ? kStairwell - 1 : 0.5;
  b.box("landing", {0, 0, -below}, {solid, 0.5 * kHall, below}, kSlab);
  if (floor + 1 == building.floors) return;
  for (int i = 0; i < kSteps; ++i) {
    const double rise = kStorey / kSteps * (i + 1);
    b.box("step", {0.5 + 5.5 / kSteps * i, 0, rise - 0.2}, {5.5 / kSteps, 0.5 * kHall, 0.2},
          kTread);
  }
}

void addStairwell(SceneBuilder& b, const Building& building) {
  const double height = kStorey * building.floors;
  Random random(building.seed, kWalks - 1);
  b.moveTo(building.length(), 0);
  b.box("stairwell_south", {0, -kWallWidth, 0}, {kStairwell, kWallWidth, height}, wallOf(random));
  b.box("stairwell_north", {0, kHall, 0}, {kStairwell, kWallWidth, height}, wallOf(random));
  b.box("stairwell_east", {kStairwell, 0, 0}, {kWallWidth, kHall, height}, wallOf(random));
  b.moveTo(0, 0, height - kStorey + kHeight);
  b.box("ceiling", {-1, -kRoomDepth - 1, 0},
        {building.length() + kStairwell + 1, kHall + 2 * kRoomDepth + 2, 0.1}, kSlab);
}

/// People who walk where the camera will, so many frames ahead of it, one after the other: each is
/// in a stretch of frames, and leaves.
void addPeople(SceneBuilder& b) {
  constexpr std::size_t kAhead = 16, kStretch = 40, kEvery = 60;  // frames
  constexpr double kNear = 0.8;  // metres: nobody stands in front of the lens
  const Material skin{0xC79A7B, Pattern::Speckles, 0.8};
  std::vector<Vector3> feet;
  for (const Pose& pose : b.scene.path)
    feet.emplace_back(pose.translation() - Vector3(0, 0, kEyes));
  for (std::size_t i = 0; i + kAhead < feet.size(); ++i) {
    if (i % kEvery >= kStretch || (feet[i + kAhead] - feet[i]).norm() < kNear) continue;
    Random random(b.params.seed, kWalks - 2 - i / kEvery);
    const Material coat = wallOf(random);
    const double height = 1.5 + 0.3 * random.uniform();
    b.moveTo(0, 0);
    b.cylinder("person", feet[i + kAhead], 0.45, height - 0.25, coat);
    b.sphere("person_head", feet[i + kAhead] + Vector3(0, 0, height - 0.13), 0.26, skin);
    b.onlyIn(2, static_cast<int>(i), static_cast<int>(i));
  }
}

/// From room to room and back to the first hall: places of the eyes, metres.
std::vector<Vector3> walkOf(const Building& building, std::uint64_t walk, double least) {
  Random random(building.seed, kWalks + walk);
  const auto below = [&random](int n) {
    return static_cast<int>(random.below(static_cast<std::uint32_t>(n)));
  };
  std::vector<Vector3> way;
  double length = 0.0;
  int floor = below(building.floors);
  const auto go = [&](double x, double y, double up = 0.0) {
    const Vector3 to(x, y, kEyes + kStorey * floor + up);
    if (!way.empty()) length += (to - way.back()).norm();
    way.push_back(to);
  };
  const double end = building.length();
  const auto changeFloor = [&](int to) {
    for (; floor != to; floor += to > floor ? 1 : -1) {
      // Up along the flight and back along the walkway above it; down the other way round.
      const bool is_up = to > floor;
      const double above = is_up ? kStorey : 0.0, under = is_up ? 0.0 : -kStorey;
      std::vector<Vector3> stairs = {{end + 0.3, 0.5, under},
                                     {end + 6.2, 0.5, above},
                                     {end + 6.5, 1.5, above},
                                     {end - 1.0, 1.5, above}};
      if (!is_up) std::reverse(stairs.begin(), stairs.end());
      for (const Vector3& place : stairs) go(place.x(), place.y(), place.z());
    }
  };
  const int first = floor;
  go(1.0, 1.0);
  while (length < least) {
    changeFloor(below(building.floors));
    const double x = kRoomLength * below(building.a_side) + 2.45;
    const double side = below(2) == 0 ? -1.0 : 1.0;
    const double door = 1.0 + side * 1.4;
    go(x, 1.0);
    go(x, door);
    go(x, door + side * 0.8);
    go(x - 1.2, door + side * 1.5);
    go(x + 1.2, door + side * 1.5);
    go(x, door + side * 0.8);
    go(x, 1.0);
  }
  changeFloor(first);
  go(1.0, 1.0);
  return way;
}

void layPath(SceneBuilder& b, const Building& building) {
  const double step = b.params.step > 0.0 ? b.params.step : kUsualStep;
  const std::vector<Vector3> way =
      walkOf(building, static_cast<std::uint64_t>(b.params.walk), step * b.params.frames);
  double yaw = 0.0;   // degrees
  double rest = 0.0;  // of the step that begins
  for (std::size_t i = 1; i < way.size(); ++i) {
    const Vector3 to = way[i] - way[i - 1];
    const double turn = std::remainder(std::atan2(to.y(), to.x()) * 180.0 / M_PI - yaw, 360.0);
    const double turning = std::abs(turn) / kTurnPerMetre;
    const double whole = turning + to.norm();
    for (; rest < whole; rest += step) {
      if (static_cast<int>(b.scene.path.size()) == b.params.frames) return;
      const double t = turning > 0.0 ? std::min(1.0, rest / turning) : 1.0;
      const double s = std::max(0.0, rest - turning) / std::max(1e-9, to.norm());
      b.lookFrom(way[i - 1] + s * to, yaw + t * turn, 0.0);
    }
    rest -= whole;
    yaw += turn;
  }
}

}  // namespace

void buildBuilding(SceneBuilder& b) {
  const Building building(b.params);
  for (int floor = 0; floor < building.floors; ++floor) addStorey(b, building, floor);
  addStairwell(b, building);
  layPath(b, building);
  if (b.params.moving) addPeople(b);
}

}  // namespace planar_mapping::evaluation
