// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/plan/plan.h"

namespace planar_mapping {

/// A wall, or an opening in one, seen from above, in the axes of a plan, metres.
struct WallRectangle {
  Vector2 center = Vector2::Zero();
  Vector2 along = Vector2::UnitX();  ///< unit length
  double length = 0.0;
  double thickness = 0.0;   ///< between its two faces where both were seen, else of the cuboids
  bool is_opening = false;  ///< between two pieces of a wall, seen free

  Vector2 corner(int number) const {  ///< 0 to 3, counter-clockwise
    const double sign_along = number == 1 || number == 2 ? 0.5 : -0.5;
    const double sign_across = number >= 2 ? 0.5 : -0.5;
    return center + sign_along * length * along +
           sign_across * thickness * Vector2(-along.y(), along.x());
  }
};

/// The walls of a storey: upright planes that reach into the height of the robot over its floor.
PLANAR_MAPPING_EXPORT std::vector<WallRectangle> wallsOf(const PlanSource& source, const Plan& plan,
                                                         const RobotModel& robot);

}  // namespace planar_mapping
