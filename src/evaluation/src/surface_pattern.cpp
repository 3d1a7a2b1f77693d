// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "surface_pattern.h"

#include <cmath>

namespace planar_mapping {
namespace evaluation {
namespace {

double hashed(std::int64_t u, std::int64_t v, std::uint32_t seed) {
  std::uint64_t h = static_cast<std::uint64_t>(u) * 0x9E3779B97F4A7C15ULL;
  h ^= static_cast<std::uint64_t>(v) * 0xC2B2AE3D27D4EB4FULL + seed;
  h ^= h >> 29u;
  h *= 0xBF58476D1CE4E5B9ULL;
  h ^= h >> 32u;
  return static_cast<double>(h & 0xFFFFFFu) / 16777215.0;
}

/// 0 within \p joint of a multiple of \p spacing, else 1.
bool isJoint(double value, double spacing, double joint) {
  const double rest = value - spacing * std::floor(value / spacing);
  return rest < joint;
}

double grain(double u, double v, std::uint32_t seed) {
  return 0.9 + 0.13 * valueNoise(u / 0.25, v / 0.02, seed) +
         0.06 * valueNoise(u / 0.04, v / 0.008, seed + 1);
}

}  // namespace

double valueNoise(double u, double v, std::uint32_t seed) {
  const double fu = std::floor(u);
  const double fv = std::floor(v);
  const auto iu = static_cast<std::int64_t>(fu);
  const auto iv = static_cast<std::int64_t>(fv);
  const double au = u - fu;
  const double av = v - fv;
  const double low = hashed(iu, iv, seed) * (1 - au) + hashed(iu + 1, iv, seed) * au;
  const double high = hashed(iu, iv + 1, seed) * (1 - au) + hashed(iu + 1, iv + 1, seed) * au;
  return low * (1 - av) + high * av;
}

double patternBrightness(Pattern pattern, double u, double v, std::uint32_t seed) {
  switch (pattern) {
    case Pattern::Plain:
      return 0.98 + 0.03 * valueNoise(u / 0.3, v / 0.3, seed);
    case Pattern::Speckles:
      return 0.93 + 0.07 * valueNoise(u / 0.2, v / 0.2, seed) +
             0.07 * valueNoise(u / 0.015, v / 0.015, seed + 1);
    case Pattern::Planks: {
      constexpr double kPlank = 0.14;
      const double row = std::floor(v / kPlank);
      const double tone = 0.88 + 0.2 * hashed(static_cast<std::int64_t>(row), 0, seed);
      return (isJoint(v, kPlank, 0.005) ? 0.65 : 1.0) * tone * grain(u + 7.3 * row, v, seed);
    }
    case Pattern::Tiles: {
      constexpr double kTile = 0.4;
      if (isJoint(u, kTile, 0.01) || isJoint(v, kTile, 0.01)) return 0.72;
      const double tone = hashed(static_cast<std::int64_t>(std::floor(u / kTile)),
                                 static_cast<std::int64_t>(std::floor(v / kTile)), seed);
      return 0.92 + 0.08 * tone + 0.06 * valueNoise(u / 0.02, v / 0.02, seed);
    }
    case Pattern::Bricks: {
      constexpr double kCourse = 0.09;
      constexpr double kBrick = 0.26;
      const double row = std::floor(v / kCourse);
      const double shifted = u + (std::fmod(std::abs(row), 2.0) < 0.5 ? 0.0 : 0.5 * kBrick);
      if (isJoint(v, kCourse, 0.012) || isJoint(shifted, kBrick, 0.012)) return 1.25;
      return 0.85 + 0.25 * hashed(static_cast<std::int64_t>(std::floor(shifted / kBrick)),
                                  static_cast<std::int64_t>(row), seed);
    }
  }
  return 1.0;
}

}  // namespace evaluation
}  // namespace planar_mapping
