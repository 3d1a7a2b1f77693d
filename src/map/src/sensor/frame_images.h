// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "sensor/depth_image.h"

namespace planar_mapping::detail {

/// The images that cells are tested against: one of the camera's, or for a cloud without a camera
/// the six faces of a cube around the sensor, along the world's axes. \param use see
/// DepthImage::fill(), \param counted see DepthImage::finish()
std::vector<DepthImage> makeDepthImages(const FrameObservation& observation,
                                        const Matrix3& rotation, const Vector3& position,
                                        const std::vector<std::uint8_t>& use, double step,
                                        const Clearing& clearing, bool counted);

}  // namespace planar_mapping::detail
