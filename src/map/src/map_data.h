// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "cell_layer.h"
#include "planar_mapping/map/planar_map.h"
#include "plane_layer.h"
#include "trajectory.h"
#include "unknown_space.h"

namespace planar_mapping::detail {

/// All that a map knows: plain values, copied with it and written to its file.
struct MapData {
  PlanarMapParams params;
  std::vector<PlaneLayer> planes;  ///< by id, ascending
  std::int32_t next_plane_id = 0;
  CellLayer cells;
  UnknownSpace unknown;
  Trajectory trajectory;

  double resolution() const { return params.approximation.resolution; }
  double unknownResolution() const {
    return params.unknown_resolution > 0.0 ? params.unknown_resolution : resolution();
  }
  double thickness() const {
    const CuboidApproximationParams& p = params.approximation;
    return p.thickness > 0.0 ? p.thickness : p.resolution;
  }
  bool isCompact() const { return params.approximation.profile == Profile::Compact; }
};

/// Stamps what was touched, for those who derive cuboids from it, and forgets what is empty.
void tidyMap(MapData& map, FrameUpdate& update);

}  // namespace planar_mapping::detail
