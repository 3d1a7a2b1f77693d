// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/PolygonMesh.h>

#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/cuboid.h"

namespace planar_mapping {

/// Cuboids as a mesh: for each of them eight vertices (field x y z, order of corners()) and six
/// quadrilaterals, counter-clockwise seen from outside. The header of \p mesh is kept.
PLANAR_MAPPING_EXPORT void writeMesh(const std::vector<Cuboid>& cuboids, pcl::PolygonMesh& mesh);

}  // namespace planar_mapping
