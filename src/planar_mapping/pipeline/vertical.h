// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping::detail {

/// `up: auto` by the planes of the first frame, where its axes alone do not tell, with what there
/// is to say of it: of a camera with a given pose, and of a cloud merged of many scans.
/// \param mean_up  FrameSource::meanUp()
void findVertical(const std::optional<Vector3>& mean_up, CloudScale& scale, Frame& frame);

}  // namespace planar_mapping::detail
