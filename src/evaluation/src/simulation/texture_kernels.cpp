// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/texture_kernels.h"

#include <algorithm>

#include "planar_mapping/core/base/detail/simd.h"

namespace planar_mapping {
namespace evaluation {
namespace {

// Inlined into every clone of the loops below; no call may stand in their way.

PLANAR_MAPPING_INLINE std::uint32_t mixed(std::int32_t u, std::int32_t v, std::uint32_t seed) {
  std::uint32_t h = static_cast<std::uint32_t>(u) * 0x9E3779B1u +
                    static_cast<std::uint32_t>(v) * 0x85EBCA77u + seed * 0xC2B2AE3Du;
  h ^= h >> 15u;
  h *= 0x2C1B3C6Du;
  h ^= h >> 12u;
  h *= 0x297A2D39u;
  h ^= h >> 15u;
  return h;
}

PLANAR_MAPPING_INLINE float unit(std::uint32_t hash) {
  return static_cast<float>(static_cast<std::int32_t>(hash >> 8u)) * (1.0f / 16777216.0f);
}

PLANAR_MAPPING_INLINE std::int32_t wholeOf(float value) {
  const auto whole = static_cast<std::int32_t>(value);
  return whole - (value < static_cast<float>(whole) ? 1 : 0);
}

PLANAR_MAPPING_INLINE float clamped(float value) {
  const float low = value > 0.0f ? value : 0.0f;
  return low < 1.0f ? low : 1.0f;
}

/// 1 for details many pixels large, 0 for those a pixel cannot show.
PLANAR_MAPPING_INLINE float visible(float cell, float footprint) {
  return clamped((cell / footprint - 1.5f) * (1.0f / 1.5f));
}

}  // namespace

float cellValue(std::int32_t u, std::int32_t v, std::uint32_t seed) {
  return unit(mixed(u, v, seed));
}

std::uint32_t cellHash(std::int32_t u, std::int32_t v, std::uint32_t seed) {
  return mixed(u, v, seed);
}

PLANAR_MAPPING_MULTIVERSION
void addNoise(const SamplePlaces& at, float cell_u, float cell_v, float cosine, float sine,
              std::uint32_t seed, float gain, float* sum) {
  const float* const us = at.u;
  const float* const vs = at.v;
  const float* const footprints = at.footprint;
  const int count = at.count;
  const float smaller = cell_u < cell_v ? cell_u : cell_v;
  const float per_u = 1.0f / cell_u;
  const float per_v = 1.0f / cell_v;
  for (int i = 0; i < count; ++i) {
    const float x = (cosine * us[i] - sine * vs[i]) * per_u;
    const float y = (sine * us[i] + cosine * vs[i]) * per_v;
    const std::int32_t ix = wholeOf(x);
    const std::int32_t iy = wholeOf(y);
    // Slopes are continuous: creases along the lattice would be lines.
    float ax = x - static_cast<float>(ix);
    float ay = y - static_cast<float>(iy);
    ax *= ax * (3.0f - 2.0f * ax);
    ay *= ay * (3.0f - 2.0f * ay);
    const float a = unit(mixed(ix, iy, seed));
    const float b = unit(mixed(ix + 1, iy, seed));
    const float c = unit(mixed(ix, iy + 1, seed));
    const float d = unit(mixed(ix + 1, iy + 1, seed));
    const float low = a + ax * (b - a);
    const float high = c + ax * (d - c);
    sum[i] += gain * visible(smaller, footprints[i]) * (2.0f * (low + ay * (high - low)) - 1.0f);
  }
}

void addAllScales(const SamplePlaces& at, std::uint32_t seed, float gain, float* sum) {
  constexpr float kCells[] = {0.512f, 0.205f, 0.082f, 0.033f, 0.013f, 0.005f};
  // Turned from scale to scale, lest all lattices share their lines.
  constexpr float kTurns[][2] = {{1.0f, 0.0f}, {0.766f, 0.643f}, {0.174f, 0.985f}};
  const float finest = *std::min_element(at.footprint, at.footprint + at.count);
  std::uint32_t scale = 0;
  for (const float cell : kCells) {
    if (visible(cell, finest) <= 0.0f) break;
    const float* turn = kTurns[scale % 3];
    addNoise(at, cell, cell, turn[0], turn[1], seed + 101u * scale, gain, sum);
    ++scale;
  }
}

PLANAR_MAPPING_MULTIVERSION
void addMosaic(const SamplePlaces& at, float cell_u, float cell_v, std::uint32_t seed, float gain,
               float* sum) {
  const float* const us = at.u;
  const float* const vs = at.v;
  const float* const footprints = at.footprint;
  const int count = at.count;
  const float smaller = cell_u < cell_v ? cell_u : cell_v;
  const float per_u = 1.0f / cell_u;
  const float per_v = 1.0f / cell_v;
  for (int i = 0; i < count; ++i) {
    const float per_footprint = 1.0f / footprints[i];
    const float x = us[i] * per_u - 0.5f;
    const float y = vs[i] * per_v - 0.5f;
    const std::int32_t ix = wholeOf(x);
    const std::int32_t iy = wholeOf(y);
    const float ax = clamped((x - static_cast<float>(ix) - 0.5f) * cell_u * per_footprint + 0.5f);
    const float ay = clamped((y - static_cast<float>(iy) - 0.5f) * cell_v * per_footprint + 0.5f);
    const float a = unit(mixed(ix, iy, seed));
    const float b = unit(mixed(ix + 1, iy, seed));
    const float c = unit(mixed(ix, iy + 1, seed));
    const float d = unit(mixed(ix + 1, iy + 1, seed));
    const float low = a + ax * (b - a);
    const float high = c + ax * (d - c);
    sum[i] += gain * visible(smaller, footprints[i]) * (2.0f * (low + ay * (high - low)) - 1.0f);
  }
}

PLANAR_MAPPING_MULTIVERSION
void addSpots(const SamplePlaces& at, float cell, std::uint32_t seed, float gain, float* sum) {
  const float* const us = at.u;
  const float* const vs = at.v;
  const float* const footprints = at.footprint;
  const int count = at.count;
  const float per_cell = 1.0f / cell;
  for (int i = 0; i < count; ++i) {
    const float x = us[i] * per_cell;
    const float y = vs[i] * per_cell;
    const std::int32_t ix = wholeOf(x);
    const std::int32_t iy = wholeOf(y);
    const std::uint32_t h = mixed(ix, iy, seed);
    const auto byteOf = [h](std::uint32_t shift) {
      return static_cast<float>(static_cast<std::int32_t>(h >> shift & 0xFFu)) * (1.0f / 255.0f);
    };
    // In units of the cell; the spot lies within it.
    const float radius = 0.1f + 0.25f * byteOf(0);
    const float reach = 1.0f - 2.0f * radius;
    const float dx = x - static_cast<float>(ix) - radius - reach * byteOf(8);
    const float dy = y - static_cast<float>(iy) - radius - reach * byteOf(16);
    // How far inside, to first order at the border, where it counts.
    const float inside = (radius * radius - dx * dx - dy * dy) / (2.0f * radius) * cell;
    const float cover = clamped(inside / footprints[i] + 0.5f);
    sum[i] += gain * visible(0.5f * cell, footprints[i]) * cover * (2.0f * byteOf(24) - 1.0f);
  }
}

PLANAR_MAPPING_MULTIVERSION
void widenJoints(const float* value, const float* footprint, int count, float spacing, float width,
                 float* joint) {
  const float per_spacing = 1.0f / spacing;
  for (int i = 0; i < count; ++i) {
    // Width of joints from 0 to either end of the interval.
    const float begin = value[i] - 0.5f * footprint[i];
    const float end = value[i] + 0.5f * footprint[i];
    const auto whole_begin = static_cast<float>(wholeOf(begin * per_spacing));
    const auto whole_end = static_cast<float>(wholeOf(end * per_spacing));
    const float rest_begin = begin - whole_begin * spacing;
    const float rest_end = end - whole_end * spacing;
    const float before = rest_begin < width ? rest_begin : width;
    const float after = rest_end < width ? rest_end : width;
    const float share = ((whole_end - whole_begin) * width + after - before) / footprint[i];
    joint[i] = share > joint[i] ? share : joint[i];
  }
}

}  // namespace evaluation
}  // namespace planar_mapping
