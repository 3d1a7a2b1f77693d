// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/base/types.h"

namespace planar_mapping::detail {

/// The image of a camera or a scanner that an unorganized cloud was before its points were taken out
/// of their rows.
struct CloudImage {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<float> xyz;    ///< of each pixel, row by row; NaN where the cloud has no point
  Indices points;            ///< the point of the cloud at each pixel, -1 = none
  std::size_t measured = 0;  ///< pixels with a point

  PointsView view() const { return {xyz.data(), width, height, 3}; }
};

/// The image of a cloud seen from one place, in whatever order its points are: the directions in
/// which they are seen lie on a lattice, by ratios of two axes to the third (the pixels of a pinhole
/// camera) or by azimuth and elevation about an axis (a scanner). Nothing where they do not, two
/// points have one pixel, or few pixels of the image have a point. O(points).
/// [ours] \param indices the points that count, or null for all that are measured
std::optional<CloudImage> imageOf(const PointsView& points, const Indices* indices,
                                  const Vector3& sensor);

}  // namespace planar_mapping::detail
