// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/plane_kernels.h"

#include "planar_mapping/core/base/detail/simd.h"

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

namespace {

// Integer weights: a float sum would not be vectorised without reordering it. A block of 2^15
// pieces of at most 2^15 each cannot overflow; larger pieces count as that much.
constexpr std::size_t kScoreBlock = 1u << 15u;

PLANAR_MAPPING_MULTIVERSION
std::int32_t scoreBlock(const float* x, const float* y, const float* z, const float* nx,
                        const float* ny, const float* nz, const float* band,
                        const std::int32_t* weight, std::size_t n, float a, float b, float c,
                        float d, float cosine) {
  std::int32_t score = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const float distance = a * x[i] + b * y[i] + c * z[i] + d;
    const float agreement = a * nx[i] + b * ny[i] + c * nz[i];
    const bool near = (distance < 0.0f ? -distance : distance) <= band[i];
    const bool agrees = (agreement < 0.0f ? -agreement : agreement) >= cosine;
    score += near & agrees ? weight[i] : 0;
  }
  return score;
}

}  // namespace

std::int64_t scorePlane(const LeafColumns& leaves, float a, float b, float c, float d,
                        float cosine) {
  std::int64_t score = 0;
  for (std::size_t begin = 0; begin < leaves.n; begin += kScoreBlock) {
    const std::size_t n = leaves.n - begin < kScoreBlock ? leaves.n - begin : kScoreBlock;
    score += scoreBlock(leaves.x + begin, leaves.y + begin, leaves.z + begin, leaves.nx + begin,
                        leaves.ny + begin, leaves.nz + begin, leaves.band + begin,
                        leaves.weight + begin, n, a, b, c, d, cosine);
  }
  return score;
}

PLANAR_MAPPING_MULTIVERSION
void classify(const float* x, const float* y, const float* z, const float* inverse_band,
              const std::uint8_t* mask, std::size_t n, float a, float b, float c, float d, float cx,
              float cy, float cz, float squared_reach, std::uint8_t* place) {
  for (std::size_t i = 0; i < n; ++i) {
    const float distance = (a * x[i] + b * y[i] + c * z[i] + d) * inverse_band[i];
    const float dx = x[i] - cx, dy = y[i] - cy, dz = z[i] - cz;
    const float away = dx * dx + dy * dy + dz * dz;
    const int on = static_cast<int>(distance <= 1.0f) & static_cast<int>(distance >= -1.0f);
    const int above = static_cast<int>(distance > 1.0f) & static_cast<int>(distance <= 3.0f);
    const int below = static_cast<int>(distance < -1.0f) & static_cast<int>(distance >= -3.0f);
    const int within = -static_cast<int>(away <= squared_reach);
    place[i] = static_cast<std::uint8_t>((on + 2 * above + 3 * below) & within & mask[i]);
  }
}

}  // namespace planar_mapping::detail
