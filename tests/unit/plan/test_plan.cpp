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

TEST(Plan, WithoutFloorOrHeadroomNothingIsFree) {
  World wall;
  wall.occupied = {between({0, 0, 0}, {0.1, 3, 2}, -1, CellState::Occupied)};
  wall.space = {between({0.1, 0, 0}, {3, 3, 2}, -1, CellState::Free)};
  EXPECT_EQ(wall.plan().freeFraction(), 0.0);
  EXPECT_NE(wall.plan().note.find("no floor"), std::string::npos) << wall.plan().note;
  EXPECT_NE(wall.plan().note.find("no path"), std::string::npos) << wall.plan().note;
  World low;
  low.floor({0, 0, -0.1}, {3, 3, 0}, 0.6);
  EXPECT_EQ(low.plan().freeFraction(), 0.0);
  EXPECT_NE(low.plan().note.find("--robot-height"), std::string::npos) << low.plan().note;
  EXPECT_EQ(plansOf(PlanSource(), RobotModel()).at(0).freeFraction(), 0.0);
  World finished;
  finished.floor({0, 0, -0.1}, {3, 3, 0});
  finished.floors.clear();
  EXPECT_EQ(finished.plan().freeFraction(), 0.0);
  EXPECT_NE(finished.plan().note.find("before finishing"), std::string::npos);
  RobotModel robot;
  robot.height = NAN;
  EXPECT_THROW(low.plan(robot), ParameterError);
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
