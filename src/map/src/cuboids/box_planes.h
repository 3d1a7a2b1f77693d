// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "store/map_data.h"
#include "planar_mapping/core/geometry/cuboid.h"

namespace planar_mapping::detail {

/// A plane beside boxes, as it is looked at while they are made.
struct NearPlane {
  std::int32_t id = 0;
  PlaneFrame frame;
  OpenRaster raster;
};

/// Boxes that lie on a plane are its cuboids: parallel to it within the angle of association, at
/// most two cells thick, within half a cell of the plane, and at least half of the face over cells
/// of this one plane. Their axes are renamed to u, v, n; they do not move. \param near  planes that
/// have cells where the boxes are
void namePlanes(const MapData& map, const std::vector<NearPlane>& near, std::vector<Cuboid>& boxes);

}  // namespace planar_mapping::detail
