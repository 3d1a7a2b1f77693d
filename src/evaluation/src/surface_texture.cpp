// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "surface_texture.h"

#include <algorithm>
#include <cmath>

namespace planar_mapping {
namespace evaluation {
namespace {

std::uint32_t hashOf(std::int32_t u, std::int32_t v, std::uint32_t seed) {
  std::uint32_t h = static_cast<std::uint32_t>(u) * 0x9E3779B1u +
                    static_cast<std::uint32_t>(v) * 0x85EBCA77u + seed * 0xC2B2AE3Du;
  h ^= h >> 15u;
  h *= 0x2C1B3C6Du;
  h ^= h >> 12u;
  h *= 0x297A2D39u;
  h ^= h >> 15u;
  return h;
}

/// Uniform in [0, 1).
double hashed(std::int32_t u, std::int32_t v, std::uint32_t seed) {
  return hashOf(u, v, seed) * (1.0 / 4294967296.0);
}

/// As hashed(), of better quality.
double hashedFinely(std::int64_t u, std::int64_t v, std::uint32_t seed) {
  std::uint64_t h = static_cast<std::uint64_t>(u) * 0x9E3779B97F4A7C15ULL;
  h ^= static_cast<std::uint64_t>(v) * 0xC2B2AE3D27D4EB4FULL + seed;
  h ^= h >> 29u;
  h *= 0xBF58476D1CE4E5B9ULL;
  h ^= h >> 32u;
  return static_cast<double>(h & 0xFFFFFFu) / 16777215.0;
}

std::int32_t wholeOf(double value) {
  return static_cast<std::int32_t>(std::floor(value));
}

/// Value noise in [-1, 1] whose slope is continuous: creases along the lattice would be lines.
double smoothNoise(double u, double v, std::uint32_t seed) {
  const std::int32_t iu = wholeOf(u);
  const std::int32_t iv = wholeOf(v);
  double au = u - iu;
  double av = v - iv;
  au *= au * (3.0 - 2.0 * au);
  av *= av * (3.0 - 2.0 * av);
  const double low = hashed(iu, iv, seed) * (1.0 - au) + hashed(iu + 1, iv, seed) * au;
  const double high = hashed(iu, iv + 1, seed) * (1.0 - au) + hashed(iu + 1, iv + 1, seed) * au;
  return 2.0 * (low * (1.0 - av) + high * av) - 1.0;
}

/// 1 for details many pixels large, 0 for those a pixel cannot show.
double visible(double cell, double footprint) {
  return std::clamp((cell / footprint - 1.5) / 1.5, 0.0, 1.0);
}

/// Noise of every scale that a pixel can show, each as strong as the others: there is something to
/// match from near and from far. Standard deviation about 0.25 for each scale.
double allScales(double u, double v, double footprint, std::uint32_t seed) {
  constexpr double kCells[] = {0.512, 0.205, 0.082, 0.033, 0.013, 0.005};
  double sum = 0.0;
  std::uint32_t octave = 0;
  for (const double cell : kCells) {
    const double weight = visible(cell, footprint);
    if (weight <= 0.0) break;
    // Turned by an irrational step, lest lattices of all scales share their lines.
    constexpr double kTurn[] = {1.0, 0.0, 0.766, 0.643, 0.174, 0.985};
    const double c = kTurn[2 * (octave % 3)] / cell;
    const double s = kTurn[2 * (octave % 3) + 1] / cell;
    sum += weight * smoothNoise(c * u - s * v, s * u + c * v, seed + 101u * octave);
    ++octave;
  }
  return sum;
}

/// Share of [value - footprint / 2, value + footprint / 2] that lies within \p joint after a
/// multiple of \p spacing.
double jointShare(double value, double spacing, double joint, double footprint) {
  const auto before = [spacing, joint](double x) {
    const double whole = std::floor(x / spacing);
    return whole * joint + std::min(x - whole * spacing, joint);
  };
  return (before(value + 0.5 * footprint) - before(value - 0.5 * footprint)) / footprint;
}

/// Random tone in [-1, 1] of each cell of a lattice, blended over a footprint at the borders.
double mosaic(double u, double v, double cell_u, double cell_v, double footprint,
              std::uint32_t seed) {
  const double x = u / cell_u - 0.5;
  const double y = v / cell_v - 0.5;
  const std::int32_t ix = wholeOf(x);
  const std::int32_t iy = wholeOf(y);
  const double ax = std::clamp((x - ix - 0.5) * cell_u / footprint + 0.5, 0.0, 1.0);
  const double ay = std::clamp((y - iy - 0.5) * cell_v / footprint + 0.5, 0.0, 1.0);
  double tone = 0.0;
  if ((1.0 - ax) * (1.0 - ay) > 0.0) tone += (1.0 - ax) * (1.0 - ay) * hashed(ix, iy, seed);
  if (ax * (1.0 - ay) > 0.0) tone += ax * (1.0 - ay) * hashed(ix + 1, iy, seed);
  if ((1.0 - ax) * ay > 0.0) tone += (1.0 - ax) * ay * hashed(ix, iy + 1, seed);
  if (ax * ay > 0.0) tone += ax * ay * hashed(ix + 1, iy + 1, seed);
  return visible(std::min(cell_u, cell_v), footprint) * (2.0 * tone - 1.0);
}

/// A round spot in each cell, dark or bright, in [-1, 1].
double spots(double u, double v, double cell, double footprint, std::uint32_t seed) {
  const double weight = visible(0.5 * cell, footprint);
  if (weight <= 0.0) return 0.0;
  const std::int32_t iu = wholeOf(u / cell);
  const std::int32_t iv = wholeOf(v / cell);
  const std::uint32_t h = hashOf(iu, iv, seed);
  const double radius = cell * (0.1 + 0.25 * (h & 0xFFu) / 255.0);
  const double reach = cell - 2.0 * radius;
  const double du = u - (iu * cell + radius + reach * (h >> 8u & 0xFFu) / 255.0);
  const double dv = v - (iv * cell + radius + reach * (h >> 16u & 0xFFu) / 255.0);
  const double inside = (radius - std::sqrt(du * du + dv * dv)) / footprint + 0.5;
  if (inside <= 0.0) return 0.0;
  const double tone = static_cast<double>(h >> 24u) / 127.5 - 1.0;
  return weight * std::min(inside, 1.0) * tone;
}

/// A poster in some square metres: how much of the footprint it covers, and its brightness.
double posterShare(double share, double u, double v, double footprint, std::uint32_t seed,
                   double& brightness) {
  const std::int32_t iu = wholeOf(u);
  const std::int32_t iv = wholeOf(v);
  const std::uint32_t h = hashOf(iu, iv, seed + 7u);
  if ((h & 0xFFFFu) * (1.0 / 65536.0) >= share) return 0.0;
  const double half_u = 0.18 + 0.14 * (h >> 16u & 0xFu) / 15.0;
  const double half_v = 0.20 + 0.18 * (h >> 20u & 0xFu) / 15.0;
  const double du = u - iu - 0.5 - (0.48 - half_u) * ((h >> 24u & 0xFu) / 7.5 - 1.0);
  const double dv = v - iv - 0.5 - (0.48 - half_v) * ((h >> 28u) / 7.5 - 1.0);
  const double inside = std::min(half_u - std::abs(du), half_v - std::abs(dv));
  const double cover = std::clamp(inside / footprint + 0.5, 0.0, 1.0);
  if (cover <= 0.0) return 0.0;
  const double frame = std::clamp((inside - 0.015) / footprint + 0.5, 0.0, 1.0);
  const double picture = 0.75 + 0.3 * mosaic(du, dv, 0.083, 0.061, footprint, h) +
                         0.16 * mosaic(du, dv, 0.019, 0.023, footprint, h + 1u) +
                         0.2 * spots(du, dv, 0.13, footprint, h + 2u);
  brightness = 0.35 * (1.0 - frame) + picture * frame;
  return cover;
}

double patternBrightness(Pattern pattern, double u, double v, double footprint, double contrast,
                         std::uint32_t seed) {
  switch (pattern) {
    case Pattern::Plain:
      return 1.0 + 0.05 * contrast * allScales(u, v, footprint, seed);
    case Pattern::Speckles:
      return 0.97 + contrast * (0.11 * allScales(u, v, footprint, seed) +
                                0.22 * spots(u, v, 0.16, footprint, seed + 50u) +
                                0.16 * spots(u, v, 0.045, footprint, seed + 51u));
    case Pattern::Planks: {
      constexpr double kPlank = 0.14;
      const double joint = jointShare(v, kPlank, 0.006, footprint);
      const double tone = mosaic(u, v, 0.9, kPlank, footprint, seed);
      const double shifted = u + 0.37 * wholeOf(v / kPlank);
      const double grain =
          visible(0.02, footprint) * smoothNoise(shifted / 0.15, v / 0.02, seed + 60u) +
          visible(0.008, footprint) * smoothNoise(shifted / 0.04, v / 0.008, seed + 61u);
      return (1.0 - 0.4 * joint) *
             (0.96 + contrast * (0.12 * tone + 0.09 * grain +
                                 0.05 * allScales(u, v, footprint, seed + 62u) +
                                 0.3 * std::min(0.0, spots(u, v, 0.11, footprint, seed + 63u))));
    }
    case Pattern::Tiles: {
      constexpr double kTile = 0.4;
      constexpr double kJoint = 0.01;
      const double joint = std::max(jointShare(u, kTile, kJoint, footprint),
                                    jointShare(v, kTile, kJoint, footprint));
      const double stone = 0.96 + contrast * (0.07 * mosaic(u, v, kTile, kTile, footprint, seed) +
                                              0.08 * allScales(u, v, footprint, seed + 70u) +
                                              0.3 * spots(u, v, 0.09, footprint, seed + 71u) +
                                              0.25 * spots(u, v, 0.025, footprint, seed + 72u));
      return stone * (1.0 - joint) + 0.65 * joint;
    }
    case Pattern::Bricks: {
      constexpr double kCourse = 0.09;
      constexpr double kBrick = 0.26;
      constexpr double kJoint = 0.012;
      const std::int32_t row = wholeOf(v / kCourse);
      const double shifted = u + ((row & 1) == 0 ? 0.0 : 0.5 * kBrick);
      const double joint = std::max(jointShare(v, kCourse, kJoint, footprint),
                                    jointShare(shifted, kBrick, kJoint, footprint));
      const double tone =
          visible(kCourse, footprint) * (2.0 * hashed(wholeOf(shifted / kBrick), row, seed) - 1.0);
      const double brick =
          0.95 + contrast * (0.2 * tone + 0.09 * allScales(u, v, footprint, seed + 80u));
      return brick * (1.0 - joint) + 1.3 * joint;
    }
  }
  return 1.0;
}

}  // namespace

double valueNoise(double u, double v, std::uint32_t seed) {
  const std::int32_t iu = wholeOf(u);
  const std::int32_t iv = wholeOf(v);
  const double au = u - iu;
  const double av = v - iv;
  const double low = hashedFinely(iu, iv, seed) * (1 - au) + hashedFinely(iu + 1, iv, seed) * au;
  const double high =
      hashedFinely(iu, iv + 1, seed) * (1 - au) + hashedFinely(iu + 1, iv + 1, seed) * au;
  return low * (1 - av) + high * av;
}

double textureAt(const Material& material, double u, double v, double plain_share,
                 std::uint32_t seed) {
  constexpr double kPlainPatch = 0.7;
  if (plain_share > 0.0 &&
      hashed(wholeOf(u / kPlainPatch), wholeOf(v / kPlainPatch), seed + 19u) < plain_share)
    return 0.0;
  const double stretch = valueNoise(u / 0.35, v / 0.35, seed + 17u);
  return std::clamp(material.texture + (1.0 - material.texture) * (2.0 * stretch - 1.0), 0.0, 1.0);
}

double brightnessAt(const Material& material, double u, double v, double footprint, double contrast,
                    bool flat, std::uint32_t seed) {
  const double size = std::max(footprint, 1e-6);
  if (contrast <= 0.0) return 0.97;
  double poster = 0.0;
  const double cover = flat && material.posters > 0.0
                           ? posterShare(material.posters, u, v, size, seed, poster)
                           : 0.0;
  if (cover >= 1.0) return poster;
  return cover * poster +
         (1.0 - cover) * patternBrightness(material.pattern, u, v, size, contrast, seed);
}

}  // namespace evaluation
}  // namespace planar_mapping
