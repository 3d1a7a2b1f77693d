// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>

#include "planar_mapping/plan/plan.h"

namespace planar_mapping::tools {

/// The robot that a plan is made for.
inline void addRobotOptions(CLI::App& command, RobotModel& robot) {
  command
      .add_option("--robot-height", robot.height,
                  "plans: height of free space that the robot needs, m (0.01 to 100)")
      ->capture_default_str();
  command
      .add_option("--robot-radius", robot.radius,
                  "plans: floor around its path that it stood on, m (0 to 100)")
      ->capture_default_str();
  command
      .add_option("--max-step", robot.max_step,
                  "plans: step up or down that it climbs, m (0 to 10)")
      ->capture_default_str();
  command
      .add_option_function<double>(
          "--max-slope",
          [&robot](double degrees) { robot.max_slope = degrees * kRadiansPerDegree; },
          "plans: slope that it climbs, degrees (0 to 60)")
      ->check(CLI::Range(0.0, 60.0))
      ->default_str("15");
  command.add_option_function<double>(
      "--camera-height", [&robot](double metres) { robot.camera_height = metres; },
      "plans: height of the sensor over the floor, m [any up to 2.5]");
}

}  // namespace planar_mapping::tools
