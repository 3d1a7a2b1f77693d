// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "keys/feature_keys.h"
#include "planar_mapping/pipeline/frame.h"
#include "planar_mapping/stereo/detail/colour_registration.h"

namespace planar_mapping::detail {

/// Whether the image has the size of the cloud, pixel by pixel.
bool showsTheCloud(const Frame& frame);

/// Brings the image of a frame to its depth: features of an image that is not registered to it get
/// the depth of something else.
/// \return whether it was found now that images lie elsewhere: earlier features are of no use
bool alignColour(FeatureKeys::Registered registered, ColourRegistration& registration,
                 Frame& frame);

}  // namespace planar_mapping::detail
