// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/surface/planar_cuboid_approximation.h"

namespace planar_mapping {

PLANAR_MAPPING_FOR_POINT_TYPES(template class, PlanarCuboidApproximation)

}  // namespace planar_mapping
