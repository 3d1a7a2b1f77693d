// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/atlas/atlas_data.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/io/image_file.h"

namespace planar_mapping {

/// What is kept of an image and its depths, see Keyframe: at most 30 kB. Id, submap, frame, source,
/// time and pose are the caller's.
///
/// Features are SIFT (at most 176, spread over the image) of the image reduced to 240 columns, so
/// that it takes a few milliseconds. A descriptor has 64 bytes: 128 square roots of the histograms
/// (RootSIFT) of 4 bits each. A cell of the grid of inverse depths is 8 pixels wide, more where the
/// image would have over 4,800 of them; its sides are width / cells_across and height / rows.
/// \param gray   one channel
/// \param cloud  organized, of the size of the image, camera frame, metres
/// \throws InputError for another size, or an image that is not gray; ParameterError for the camera
PLANAR_MAPPING_EXPORT Keyframe makeKeyframe(const io::Image& gray, const PointsView& cloud,
                                            const FeatureCamera& camera);

/// What is kept of a cloud without an image: at most 4,800 points, spread over it, 29 kB. None if
/// no point was measured.
/// \param cloud    sensor's frame, metres
/// \param is_scan  of a scanner, which looks all around
PLANAR_MAPPING_EXPORT Keyframe makeKeyframe(const PointsView& cloud, bool is_scan);

}  // namespace planar_mapping
