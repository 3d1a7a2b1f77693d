// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "planar_mapping/core/base/types.h"

namespace planar_mapping::detail {

/// The point of an organized cloud at a place between pixels: between four points of one surface,
/// else the nearest of the points around, because a corner belongs to the surface in front. \return
/// nothing if none of them was measured
std::optional<Vector3> pointAt(const PointsView& cloud, float column, float row);

}  // namespace planar_mapping::detail
