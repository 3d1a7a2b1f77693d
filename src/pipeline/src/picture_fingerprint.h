// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping::detail {

/// A number that two frames share only if their images (and, of RGB-D, their depths) are the same,
/// pixel for pixel: sensor noise never repeats, a frozen camera does. 0 for a frame without images.
std::uint64_t pictureFingerprint(const Frame& frame);

}  // namespace planar_mapping::detail
