// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "plan_scene.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/plan/plan.h"

namespace planar_mapping {
namespace {

Cuboid between(const Vector3& low, const Vector3& high, int plane, CellState state) {
  Cuboid cuboid;
  cuboid.center = 0.5 * (low + high);
  cuboid.size = high - low;
  cuboid.plane_id = plane;
  cuboid.state = state;
  return cuboid;
}

struct World : PlanSource {
  World& floor(const Vector3& low, const Vector3& high, double headroom = 2.0) {
    occupied.push_back(between(low, high, int(occupied.size()), CellState::Occupied));
    floors.push_back(test::measured(low, high, resolution));
    space.push_back(between({low.x(), low.y(), high.z()}, {high.x(), high.y(), high.z() + headroom},
                            -1, CellState::Free));
    return *this;
  }
  Plan plan(const RobotModel& robot = RobotModel()) const { return plansOf(*this, robot).at(0); }
};

TEST(Plan, YardBelowADockIsNotReachedAndTheEdgeIsLethal) {
  World world;
  world.floor({0, 0, -0.1}, {3, 2, 0}).floor({3, 0, -1.3}, {6, 2, -1.2});
  world.path = {{1, 1, 0.5}};
  const Plan plan = world.plan();
  EXPECT_TRUE(plan.isStandable(1.55, 1.05));
  EXPECT_FALSE(plan.isStandable(4.05, 1.05));
  std::uint32_t x = 0, y = 0;
  ASSERT_TRUE(plan.cellOf(2.95, 1.05, x, y));
  EXPECT_EQ(plan.at(x, y), Plan::kOccupied);
}

TEST(Plan, PlacesOfThePathAreFreeWhereTheFloorWasNotSeen) {
  World world;
  world.floor({2, 0, -0.1}, {5, 2, 0});
  world.path = {{0.5, 1.05, 0.5}, {1.5, 1.05, 0.5}};
  const Plan plan = world.plan();
  EXPECT_TRUE(plan.isStandable(0.55, 1.05));
  EXPECT_TRUE(plan.isStandable(1.05, 1.05)) << "between two places";
  EXPECT_FALSE(plan.isStandable(1.05, 1.65));
  world.path = {{0.5, 1.05, 4.0}};
  EXPECT_FALSE(world.plan().isStandable(0.55, 1.05)) << "no sensor is as high";
}

TEST(Plan, ATooWideRobotStoodNoFartherThanTheNearestObstacle) {
  World world;
  world.floor({2, 0, -0.1}, {5, 2, 0});
  world.occupied.push_back(between({0, 1.5, 0}, {2, 1.6, 1}, -1, CellState::Occupied));
  world.path = {{1.05, 1.05, 0.5}};
  RobotModel robot;
  robot.radius = 1.0;
  const Plan plan = world.plan(robot);
  EXPECT_TRUE(plan.isStandable(1.05, 1.05) && plan.isStandable(1.05, 0.75));
  EXPECT_FALSE(plan.isStandable(1.05, 0.25) || plan.isStandable(1.05, 1.95));
}

TEST(Plan, StoreysHavePlansOfTheirOwn) {
  World world;
  world.floor({0, 0, -0.1}, {4, 4, 0}).floor({0, 0, 2.9}, {4, 4, 3.0});
  world.path = {{1, 1, 0.5}, {1, 1, 3.5}};
  const std::vector<Plan> plans = plansOf(world, RobotModel());
  ASSERT_EQ(plans.size(), 2u);
  EXPECT_NEAR(plans[0].floor, -0.05, 1e-6);
  EXPECT_NEAR(plans[1].floor, 2.95, 1e-6);
  EXPECT_TRUE(plans[0].isStandable(2.05, 2.05) && plans[1].isStandable(2.05, 2.05));
}

/// What is missing in a plan, and the words that say so.
struct Lack {
  const char* name;
  PlanSource source;
  RobotModel robot;
  const char* words;
  bool is_free = false;  ///< is any cell?
};

TEST(Plan, SaysWhatIsMissingAndFreesNoCellWithoutAMeasuredFloor) {
  World wall, room, low, table, lane;
  wall.occupied = {between({0, 0, 0}, {0.1, 3, 2}, -1, CellState::Occupied)};
  wall.space = {between({0.1, 0, 0}, {3, 3, 2}, -1, CellState::Free)};
  room.floor({0, 0, -0.1}, {3, 3, 0});
  low.floor({0, 0, -0.1}, {3, 3, 0}, 0.6);
  table.floor({0, 0, 0.7}, {1.6, 1.2, 0.73});
  lane.floor({0, 0, -0.1}, {6, 1, 0});
  for (const double y : {-0.1, 1.0})
    lane.occupied.push_back(between({0, y, 0}, {6, y + 0.1, 1}, -1, CellState::Occupied));
  PlanSource finished = room;
  finished.floors.clear();
  RobotModel tall, wide;
  tall.height = 2.5;
  wide.radius = 0.6;
  const RobotModel robot;
  const Lack lacks[] = {
      {"nothing", PlanSource(), robot, "no floor was measured: no level face"},
      {"a wall", wall, robot, "no floor that the robot reaches was measured"},
      {"a table", table, robot, "no floor that the robot reaches was measured"},
      {"no path", room, robot, "the map has no path", true},
      {"finished", finished, robot, "plan before finishing"},
      {"low space", low, robot, "a lower --robot-height"},
      {"too tall", room, tall, "a lower --robot-height"},
      {"too wide", lane, wide, "the robot is too wide", true},
      {"as wide as the lane", lane, robot, "m2 free", true},
  };
  for (const Lack& lack : lacks) {
    const Plan plan = plansOf(lack.source, lack.robot).at(0);
    EXPECT_EQ(plan.freeFraction() > 0.0, lack.is_free) << lack.name;
    EXPECT_NE(plan.note.find(lack.words), std::string::npos) << lack.name << ": " << plan.note;
    EXPECT_EQ(plan.note.find("too wide") != std::string::npos, lack.robot.radius == wide.radius)
        << lack.name << ": " << plan.note;
  }
}

TEST(Plan, LowThingsInAGapAreNoFloor) {
  World world;
  world.floor({0, 0, -0.1}, {2, 3, 0}).floor({2.1, 0, -0.1}, {4, 3, 0});
  world.path = {{0.5, 0.5, 0.5}};
  EXPECT_FALSE(world.plan().isStandable(2.15, 1.55)) << "beside what was not measured";
  world.occupied.push_back(between({2.0, 0.0, -0.1}, {2.1, 3.0, 0.0}, -1, CellState::Occupied));
  EXPECT_FALSE(world.plan().isStandable(2.15, 1.55)) << "points in the gap";
  EXPECT_TRUE(world.plan().isStandable(2.25, 1.55));
}

TEST(Plan, RobotsOutOfRangeAreRefused) {
  RobotModel robot;
  robot.height = NAN;
  EXPECT_THROW(World().plan(robot), ParameterError);
  robot.height = robot.max_step;
  EXPECT_THROW(World().plan(robot), ParameterError);
}

/// A corridor with a table, and a trench beyond it.
const PlanarMap& corridor() {
  static const PlanarMap map = [] {
    test::PlanScene scene;
    scene.rings = 24;
    scene.walls(-1.0, 10.0).floor(-1.0, 6.0).floor(6.0, 6.4, -0.6).floor(6.4, 10.0);
    scene.add({3.0, 0.3, 0.67}, {4.2, 1.3, 0.73}).drive(0.0, 5.2, 0.8);
    return scene.map();
  }();
  return map;
}

TEST(Plan, AroundASensorIsThePlanOfTheMap) {
  const PlanarMap& map = corridor();
  const Plan whole = plansOf(map).at(0);
  const Vector3 sensor = map.trajectory().at(4).second.translation();
  const double reach = 2.0;
  const Plan around = planAround(map, sensor, reach);
  EXPECT_LT(std::count(around.values.begin(), around.values.end(), Plan::kFree),
            std::count(whole.values.begin(), whole.values.end(), Plan::kFree));
  int free = 0, occupied = 0;
  for (double y = sensor.y() - reach + 0.15; y < sensor.y() + reach - 0.15; y += whole.cell) {
    for (double x = sensor.x() - reach + 0.15; x < sensor.x() + reach - 0.15; x += whole.cell) {
      std::uint32_t column = 0, row = 0;
      if (!whole.cellOf(x, y, column, row)) continue;
      const int value = whole.at(column, row);
      ASSERT_TRUE(around.cellOf(x, y, column, row));
      EXPECT_EQ(int(around.at(column, row)), value) << x << ' ' << y;
      free += value == Plan::kFree ? 1 : 0;
      occupied += value == Plan::kOccupied ? 1 : 0;
    }
  }
  EXPECT_GT(free, 300);
  EXPECT_GT(occupied, 50);
}

TEST(Plan, AroundAPlaceThatIsNoneIsRefusedAndAroundAFarOneNothingIsFree) {
  const PlanarMap& map = corridor();
  EXPECT_THROW(planAround(map, {NAN, 0, 0}, 2.0), ParameterError);
  EXPECT_THROW(planAround(map, {0, 0, 0.4}, -1.0), ParameterError);
  EXPECT_THROW(planAround(map, {0, 0, 0.4}, NAN), ParameterError);
  const Plan far = planAround(map, {1000, 0, 0.4}, 2.0);
  EXPECT_EQ(far.freeFraction(), 0.0);
  EXPECT_NE(far.note.find("no floor was measured"), std::string::npos) << far.note;
}

TEST(Plan, FramesOfOnePlaceAndFinishedMapsFreeWhatWasMeasured) {
  test::PlanScene scene;
  const PlanarMap map = scene.walls(-1.0, 5.0).floor(-1.0, 5.0).drive(0.0, 0.0).map();
  const Plan plan = plansOf(map).at(0);
  test::PlanFigures figures = test::figuresOf(scene, plan, RobotModel());
  EXPECT_GT(plan.freeFraction(), 0.0);
  EXPECT_EQ(figures.over_drops + figures.in_obstacles, 0);
  const Plan finished = plansOf(map.finished()).at(0);
  const double free = double(std::count(finished.values.begin(), finished.values.end(), 0));
  EXPECT_LE(free * finished.cell * finished.cell, 1.3 * M_PI * 0.25 * 0.25) << "the path's place";
  EXPECT_NE(finished.note.find("plan before finishing"), std::string::npos) << finished.note;
}

TEST(Plan, DistancesAreExact) {
  Plan plan;
  plan.width = 31;
  plan.height = 17;
  plan.values.assign(std::size_t{31} * 17, Plan::kFree);
  const std::pair<int, int> obstacles[] = {{3, 4}, {20, 16}, {30, 0}};
  for (const auto& [x, y] : obstacles) plan.values[std::size_t(y * 31 + x)] = Plan::kOccupied;
  const std::vector<float> field = plan.distances();
  for (int y = 0; y < 17; ++y)
    for (int x = 0; x < 31; ++x) {
      double nearest = INFINITY;
      for (const auto& [a, b] : obstacles) nearest = std::min(nearest, std::hypot(a - x, b - y));
      EXPECT_NEAR(field[std::size_t(y * 31 + x)], 0.1 * nearest, 1e-5);
    }
}

}  // namespace
}  // namespace planar_mapping
