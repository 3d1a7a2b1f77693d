// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

// Plain loops over coordinates that exist for several instruction sets. Coordinates are relative
// to an origin near the points, so that float is enough; planes are (a, b, c, d) about the same
// origin; z of the band is the depth itself, hence the separate array.
namespace planar_mapping::detail {

/// Gives each point the nearest of \p planes within max(constant, per_square_depth * depth^2).
/// \p best holds scratch of \p n floats; \p label gets the plane or -1.
void nearestPlane(const float* x, const float* y, const float* z, const float* depth, std::size_t n,
                  const float* planes, std::size_t number_of_planes, float constant,
                  float per_square_depth, float* best, std::int32_t* label);

/// Pieces of surface as columns: mean, unit normal, half width of the band and weight.
struct LeafColumns {
  const float* x;
  const float* y;
  const float* z;
  const float* nx;
  const float* ny;
  const float* nz;
  const float* band;
  const std::int32_t* weight;
  std::size_t n;
};

/// Weight of the pieces within their band of the plane whose normals agree with it to \p cosine.
std::int64_t scorePlane(const LeafColumns& leaves, float a, float b, float c, float d,
                        float cosine);

/// Where each point is as seen from a plane: 1 on it (within its band), 2 and 3 in the slab of the
/// same thickness above and below, 0 elsewhere, farther than the square of the reach from
/// (cx, cy, cz), or where \p mask is 0 (else it is 255).
void classify(const float* x, const float* y, const float* z, const float* inverse_band,
              const std::uint8_t* mask, std::size_t n, float a, float b, float c, float d, float cx,
              float cy, float cz, float squared_reach, std::uint8_t* place);

}  // namespace planar_mapping::detail
