// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The table of docs/results.md: plans of simulated edges. --gtest_filter=PlanScenes.* prints it.
#include <gtest/gtest.h>

#include <cstdio>

#include "plan_scene.h"

namespace planar_mapping {
namespace {

TEST(PlanScenes, NoCellOverADropIsFreeAndWhatIsDrivableIs) {
  const RobotModel robot;
  std::printf("%-28s %10s %10s %10s %10s\n", "scene", "over drop", "obstacle", "drivable",
              "free %");
  int all_drivable = 0, all_free = 0;
  for (test::PlanScene& scene : test::planScenes()) {
    const PlanarMap map = scene.map();
    const std::vector<Plan> plans = plansOf(map, robot);
    ASSERT_EQ(plans.size(), 1u) << scene.name;
    const test::PlanFigures figures = test::figuresOf(scene, plans[0], robot);
    const double free = 100.0 * figures.free / std::max(figures.drivable, 1);
    std::printf("%-28s %10d %10d %10d %10.1f\n", scene.name.c_str(), figures.over_drops,
                figures.in_obstacles, figures.drivable, free);
    EXPECT_EQ(figures.over_drops, 0) << scene.name;
    EXPECT_EQ(figures.in_obstacles, 0) << scene.name;
    EXPECT_GE(free, 80.0) << scene.name;
    all_drivable += figures.drivable;
    all_free += figures.free;
  }
  const double free = 100.0 * all_free / all_drivable;
  std::printf("%-28s %10s %10s %10d %10.1f\n", "all", "", "", all_drivable, free);
  EXPECT_GE(free, 90.0);
}

}  // namespace
}  // namespace planar_mapping
