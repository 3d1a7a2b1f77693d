// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace planar_mapping {
namespace evaluation {

/// Places on a surface: coordinates and footprints, metres.
struct SamplePlaces {
  const float* u;
  const float* v;
  const float* footprint;
  int count;
};

/// Random value in [0, 1) of a cell of a lattice.
float cellValue(std::int32_t u, std::int32_t v, std::uint32_t seed);
std::uint32_t cellHash(std::int32_t u, std::int32_t v, std::uint32_t seed);

// Each adds to sum[i]; what is too small for the footprint adds nothing.

/// gain times smooth value noise in [-1, 1], its lattice turned by (cosine, sine).
void addNoise(const SamplePlaces& at, float cell_u, float cell_v, float cosine, float sine,
              std::uint32_t seed, float gain, float* sum);
/// gain times noise of every scale that a pixel can show, each as strong as the others: there is
/// something to match from near and from far.
void addAllScales(const SamplePlaces& at, std::uint32_t seed, float gain, float* sum);
/// gain times a tone in [-1, 1] for each cell, blended over a footprint at the borders.
void addMosaic(const SamplePlaces& at, float cell_u, float cell_v, std::uint32_t seed, float gain,
               float* sum);
/// gain times a tone in [-1, 1] on a round spot in each cell, 0 beside it.
void addSpots(const SamplePlaces& at, float cell, std::uint32_t seed, float gain, float* sum);

/// joint[i] becomes the share of [value - footprint / 2, value + footprint / 2] that lies within
/// width after a multiple of spacing, or stays what it is where that is larger.
void widenJoints(const float* value, const float* footprint, int count, float spacing, float width,
                 float* joint);

}  // namespace evaluation
}  // namespace planar_mapping
