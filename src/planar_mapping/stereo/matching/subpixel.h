// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace planar_mapping::detail {

/// Improves disparities below the pixel: each becomes the mean of the similar ones around it plus
/// the shift that makes the right image fit the left one best in a window, by least squares on gray
/// values freed of their mean. Semi-global matching by itself pulls towards whole disparities.
/// \param left, right  gray, row by row without padding
/// \param window  side of the window, odd
/// \param refine  false: disparities stay as they are
/// \param disparity  row by row, NaN = none, which stays none
/// \param agreement  correlation of the gradients of both images in the window, in [-1, 1]: about 0
///                   where all they show is noise, which two cameras do not have in common
void refineDisparity(const std::uint8_t* left, const std::uint8_t* right, int width, int height,
                     int window, bool refine, int threads, float* disparity, float* agreement);

}  // namespace planar_mapping::detail
