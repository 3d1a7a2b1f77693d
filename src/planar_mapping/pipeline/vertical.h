// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/ground/up.h"
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping::detail {

/// `up: auto` by upOf() the first frame; says what it chose where that is not z, and warns where it
/// is in doubt.
/// \param images  FrameSource::meanUp()
void findVertical(const std::optional<ImagesUp>& images, CloudScale& scale, Frame& frame);

}  // namespace planar_mapping::detail
