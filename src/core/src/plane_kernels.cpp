// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "plane_kernels.h"

#include "planar_mapping/core/simd.h"

namespace planar_mapping::detail {

PLANAR_MAPPING_MULTIVERSION
void nearestPlane(const float* x, const float* y, const float* z, const float* depth, std::size_t n,
                  const float* planes, std::size_t number_of_planes, float constant,
                  float per_square_depth, float* best, std::int32_t* label) {
  // The band includes its border: start a little outside it.
  const float border = 1.0f + 1e-6f;
  for (std::size_t i = 0; i < n; ++i) {
    const float follows = per_square_depth * depth[i] * depth[i];
    best[i] = border * (follows > constant ? follows : constant);
    label[i] = -1;
  }
  for (std::size_t p = 0; p < number_of_planes; ++p) {
    const float a = planes[4 * p], b = planes[4 * p + 1];
    const float c = planes[4 * p + 2], d = planes[4 * p + 3];
    const auto name = static_cast<std::int32_t>(p);
    for (std::size_t i = 0; i < n; ++i) {
      const float signed_distance = a * x[i] + b * y[i] + c * z[i] + d;
      const float distance = signed_distance < 0.0f ? -signed_distance : signed_distance;
      const bool nearer = distance < best[i];
      best[i] = nearer ? distance : best[i];
      label[i] = nearer ? name : label[i];
    }
  }
}

}  // namespace planar_mapping::detail
