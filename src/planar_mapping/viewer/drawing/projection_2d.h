// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/base/export.h"
#include "planar_mapping/plan/plan.h"
#include "planar_mapping/viewer/scene/scene_content.h"
#include "planar_mapping/viewer/scene/view_options.h"
#include "planar_mapping/viewer/window/image.h"

namespace planar_mapping {

/// A storey as a plan (the paper, Fig. 10b), the grid of plansOf() in colours: occupied dark, free
/// white, unknown gray, the path dashed with an arrow, a scale bar. Drawn off screen as
/// renderSnapshot() draws. options: width, height, zoom, show (occupied, unknown, trajectory,
/// ground_grid, legend) apply.
/// \param storey  the lowest is 0
/// \throws RenderError if nothing here can draw; InputError; ParameterError, also for a storey that
///         there is not
PLANAR_MAPPING_EXPORT Image drawProjection2d(const SceneContent& content,
                                             const ViewOptions& options = ViewOptions(),
                                             const RobotModel& robot = RobotModel(),
                                             std::size_t storey = 0);

}  // namespace planar_mapping
