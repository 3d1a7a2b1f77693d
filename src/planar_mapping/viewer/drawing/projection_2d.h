// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/base/export.h"
#include "planar_mapping/viewer/scene/scene_content.h"
#include "planar_mapping/viewer/scene/view_options.h"
#include "planar_mapping/viewer/window/image.h"

namespace planar_mapping {

/// What counts in the 2-D projection. Heights in metres above groundHeight().
struct PLANAR_MAPPING_EXPORT ProjectionOptions {
  double lowest = 0.15;  ///< [ours] below it, it is floor
  double highest = 1.8;  ///< [ours] above it, a robot passes under
  /// [ours] A place is free if at least this fraction of the column over it is: io::GridBand.
  double fraction = 0.75;
  /// \throws ParameterError
  void validate() const;
};

/// The map from above as a plan (the paper, Fig. 10b): occupied dark, free white, unknown gray,
/// the path dashed with an arrow, a scale bar. Drawn off screen as renderSnapshot() draws.
/// options: width, height, zoom, show (occupied, unknown, trajectory, ground_grid, legend) apply.
/// \throws RenderError if nothing here can draw; InputError, ParameterError
PLANAR_MAPPING_EXPORT Image drawProjection2d(const SceneContent& content,
                                             const ViewOptions& options = ViewOptions(),
                                             const ProjectionOptions& projection = {});

}  // namespace planar_mapping
