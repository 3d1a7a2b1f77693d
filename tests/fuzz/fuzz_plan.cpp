// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Plans of any cuboids, floors, ground, path and robot.
#include "fuzz.h"
#include "planar_mapping/plan/plan.h"

using namespace planar_mapping;

namespace {

constexpr double kReach = 1.0;  // metres: small, for many executions

Vector3 anyPlace(fuzz::Input& input) {
  return {input.between(-kReach, kReach), input.between(-kReach, kReach),
          input.between(-kReach, kReach)};
}

Cuboid anyCuboid(fuzz::Input& input) {
  Cuboid cuboid;
  cuboid.center = anyPlace(input);
  for (double& side : cuboid.size) side = input.between(0.01, 2.0);
  if (input.flag()) {
    const Vector3 axis = anyPlace(input) + Vector3(1e-3, 0.0, 0.0);
    cuboid.orientation = Eigen::AngleAxisd(input.between(-3, 3), axis.normalized());
  }
  cuboid.plane_id = static_cast<std::int32_t>(input.below(4)) - 1;
  return cuboid;
}

PlanSource anySource(fuzz::Input& input) {
  PlanSource source;
  source.resolution = input.between(0.1, 0.5);
  source.unseen = input.flag() ? Unseen::Unknown : Unseen::Free;
  source.knows_sides = input.flag();
  if (input.below(4) == 0) source.up = (anyPlace(input) + Vector3(0, 0, 1e-3)).normalized();
  for (unsigned i = input.below(8); i > 0; --i) {
    source.occupied.push_back(anyCuboid(input));
    source.occupied.back().state = input.below(8) == 0 ? CellState::Free : CellState::Occupied;
  }
  for (unsigned i = input.below(4); i > 0; --i) {
    source.space.push_back(anyCuboid(input));
    source.space.back().plane_id = -1;
  }
  for (unsigned i = input.below(4); i > 0; --i)
    source.ground.push_back({anyPlace(input), 1 + input.below(200)});
  for (unsigned i = input.below(6); i > 0; --i) source.path.push_back(anyPlace(input));
  for (std::int32_t id = 0; id < static_cast<std::int32_t>(input.below(3)); ++id) {
    MapPlane plane;
    plane.id = id;
    plane.plane.normal = (anyPlace(input) + Vector3(0, 0, 1e-3)).normalized();
    plane.plane.offset = input.between(-kReach, kReach);
    source.planes.push_back(plane);
  }
  for (unsigned i = input.below(3); i > 0; --i) {
    MeasuredCells floor;
    const Vector3 rise = input.flag() ? Vector3(0, 0, 1) : anyPlace(input) + Vector3(0, 0, 1e-3);
    floor.n = rise.normalized();
    floor.origin = anyPlace(input);
    floor.u = floor.n.unitOrthogonal();
    floor.v = floor.n.cross(floor.u);
    const auto side = static_cast<std::int32_t>(1 + input.below(12));
    const std::uint64_t holes = input.number<std::uint64_t>();
    for (std::int32_t a = 0; a < side; ++a)
      for (std::int32_t b = 0; b < side; ++b)
        if (((holes >> ((7 * a + b) % 64)) & 1U) != 0) floor.cells.emplace_back(a, b);
    source.floors.push_back(floor);
  }
  return source;
}

RobotModel anyRobot(fuzz::Input& input) {
  RobotModel robot;
  if (input.flag()) return robot;
  robot.height = input.between(0.0, 2.0);
  robot.radius = input.between(0.0, 0.6);
  robot.max_step = input.between(0.0, 0.5);
  robot.max_slope = input.between(0.0, 1.1);
  if (input.flag()) robot.camera_height = input.between(0.0, 2.0);
  return robot;
}

/// Does a cuboid that begins above a step stand over the middle of a cell, in the robot's height?
bool isInObstacle(const PlanSource& source, const RobotModel& robot, const Vector3& floor) {
  constexpr int kSamples = 16;  // of the height
  const double step = floor.z() + robot.max_step + 1e-4;
  const double top = floor.z() + robot.height - 1e-4;
  for (Cuboid cuboid : source.occupied) {
    const double bottom = cuboid.center.z() - reach(cuboid).z();
    cuboid.size.array() -= 1e-5;  // at its faces either is right
    if (cuboid.state != CellState::Occupied || bottom < step) continue;
    for (int i = 0; i < kSamples && step < top; ++i)
      if (contains(cuboid, {floor.x(), floor.y(), step + (top - step) * i / (kSamples - 1)}))
        return true;
  }
  return false;
}

bool isNearPath(const PlanSource& source, const RobotModel& robot, const Plan& plan,
                const Vector3& floor) {
  constexpr double kStride = 2.0;  // metres between places that are joined
  for (const Vector3& place : source.path)
    if ((place - floor).head<2>().norm() <= robot.radius + 2.0 * plan.cell + kStride) return true;
  return false;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const RobotModel robot = anyRobot(input);
  const PlanSource source = anySource(input);
  std::vector<Plan> plans;
  if (!fuzz::succeeds([&] { plans = plansOf(source, robot, input.between(0.1, 0.5)); })) return 0;
  fuzz::require(!plans.empty(), "a plan of anything");
  const bool has_floor = !source.floors.empty() || !source.ground.empty();
  for (const Plan& plan : plans) {
    const std::size_t cells = std::size_t{plan.width} * plan.height;
    fuzz::require(plan.values.size() == cells && plan.heights.size() == cells, "all cells");
    fuzz::require(!plan.note.empty() && plan.distances().size() == cells, "a note, distances");
    for (std::size_t i = 0; i < cells; ++i) {
      if (plan.values[i] != Plan::kFree) continue;
      const Vector3 floor(plan.origin.x() + plan.cell * (double(i % plan.width) + 0.5),
                          plan.origin.y() + plan.cell * (double(i / plan.width) + 0.5),
                          plan.heights[i]);
      fuzz::require(floor.allFinite(), "a free cell has a floor");
      if (source.up != Vector3::UnitZ()) continue;
      fuzz::require(!isInObstacle(source, robot, floor), "a free cell is in no obstacle");
      fuzz::require(has_floor || isNearPath(source, robot, plan, floor),
                    "without a measured floor nothing is free away from the path");
    }
  }
  return 0;
}
