// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A robot is planned over the plans of real rooms. The rows of docs/results.md:
// pipeline_plans_slow --gtest_filter=RealPlans.*
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <queue>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/plan/plan.h"
#include "real_run.h"

namespace planar_mapping {
namespace {

/// Length of the shortest way over free cells, by A*, metres; NaN if there is none.
double wayOver(const Plan& plan, const Vector2& from, const Vector2& to) {
  std::uint32_t fx = 0, fy = 0, tx = 0, ty = 0;
  if (!plan.isStandable(from.x(), from.y()) || !plan.isStandable(to.x(), to.y())) return NAN;
  plan.cellOf(from.x(), from.y(), fx, fy);
  plan.cellOf(to.x(), to.y(), tx, ty);
  std::vector<double> length(plan.values.size(), std::numeric_limits<double>::infinity());
  using Entry = std::pair<double, std::pair<int, int>>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  const auto at = [&](int x, int y) {
    return static_cast<std::size_t>(y) * plan.width + static_cast<std::size_t>(x);
  };
  const auto rest = [&](int x, int y) {
    return std::hypot(x - static_cast<int>(tx), y - static_cast<int>(ty));
  };
  length[at(static_cast<int>(fx), static_cast<int>(fy))] = 0.0;
  open.push({0.0, {fx, fy}});
  while (!open.empty()) {
    const auto [x, y] = open.top().second;
    open.pop();
    const double here = length[at(x, y)];
    if (x == static_cast<int>(tx) && y == static_cast<int>(ty)) return plan.cell * here;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int nx = x + dx, ny = y + dy;
        if (nx < 0 || ny < 0 || nx >= static_cast<int>(plan.width) ||
            ny >= static_cast<int>(plan.height) || plan.values[at(nx, ny)] != Plan::kFree)
          continue;
        const double next = here + std::hypot(dx, dy);
        if (next >= length[at(nx, ny)]) continue;
        length[at(nx, ny)] = next;
        open.push({next + rest(nx, ny), {nx, ny}});
      }
    }
  }
  return NAN;
}

struct Room {
  const char* name;
  const char* configuration;
};

class RealPlans : public testing::TestWithParam<Room> {};

TEST_P(RealPlans, LeadFromTheFirstPlaceToTheLast) {
  const Room room = GetParam();
  if (test::isMissing(room.name)) GTEST_SKIP() << room.name << " is not beside the sources";
  const PlanarMap map = runOver({room.name}, {0, -1, 1}, room.configuration, {}).map;
  const Vector3 up = map.params().approximation.up.normalized();
  const Quaternion turn = Quaternion::FromTwoVectors(up, Vector3::UnitZ());
  const Vector3 first = turn * map.trajectory().front().second.translation();
  const Vector3 last = turn * map.trajectory().back().second.translation();
  double way = NAN;
  int places = 0, free_places = 0;
  const std::vector<Plan> plans = plansOf(map);
  for (const Plan& plan : plans) {
    if (std::isnan(way)) way = wayOver(plan, first.head<2>(), last.head<2>());
  }
  for (const auto& [time, pose] : map.trajectory()) {
    const Vector3 place = turn * pose.translation();
    ++places;
    free_places += std::any_of(plans.begin(), plans.end(), [&](const Plan& plan) {
      return plan.isStandable(place.x(), place.y());
    });
  }
  std::printf("| %s | %zu | %.0f | %d of %d | %.1f |\n", room.name, plans.size(),
              100.0 * plans[0].freeFraction(), free_places, places, way);
  std::printf("%s\n", plans[0].note.c_str());
  EXPECT_GE(way, (last - first).head<2>().norm() - 2.0 * plans[0].cell);
}

INSTANTIATE_TEST_SUITE_P(Rooms, RealPlans,
                         testing::Values(Room{"rgbd_tum_cabinet", "rgbd_indoor.yaml"},
                                         Room{"rgbd_tartanair_corridor", "rgbd_indoor.yaml"},
                                         Room{"rgbd_icl_livingroom", "rgbd_indoor.yaml"},
                                         Room{"rgbd_icl_five", "rgbd_indoor.yaml"},
                                         Room{"rgbd_redkitchen", "rgbd_indoor.yaml"},
                                         Room{"clouds_balm_hall", "pcd_sequence.yaml"},
                                         Room{"stereo_euroc_room", "stereo_indoor.yaml"}),
                         [](const auto& room) { return std::string(room.param.name); });

}  // namespace
}  // namespace planar_mapping
