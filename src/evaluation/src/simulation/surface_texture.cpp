// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/surface_texture.h"

#include <algorithm>
#include <cmath>

#include "simulation/texture_kernels.h"

namespace planar_mapping {
namespace evaluation {
namespace {

constexpr float kPlainBrightness = 0.97f;  ///< of surface without texture

double hashed(std::int64_t u, std::int64_t v, std::uint32_t seed) {
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

/// A poster in some square metres: how much of the footprint it covers, and its brightness.
float posterShare(double share, float u, float v, float footprint, std::uint32_t seed,
                  float& brightness) {
  const std::int32_t iu = wholeOf(static_cast<double>(u));
  const std::int32_t iv = wholeOf(static_cast<double>(v));
  const std::uint32_t h = cellHash(iu, iv, seed + 7u);
  if ((h & 0xFFFFu) * (1.0 / 65536.0) >= share) return 0.0f;
  const auto part = [h](unsigned shift) { return static_cast<float>(h >> shift & 0xFu) / 15.0f; };
  const float half_u = 0.18f + 0.14f * part(16);
  const float half_v = 0.20f + 0.18f * part(20);
  const float du = u - static_cast<float>(iu) - 0.5f - (0.48f - half_u) * (2.0f * part(24) - 1.0f);
  const float dv = v - static_cast<float>(iv) - 0.5f - (0.48f - half_v) * (2.0f * part(28) - 1.0f);
  const float inside = std::min(half_u - std::abs(du), half_v - std::abs(dv));
  const float cover = std::clamp(inside / footprint + 0.5f, 0.0f, 1.0f);
  if (cover <= 0.0f) return 0.0f;
  constexpr float kBorder = 0.015f;
  const float picture_share = std::clamp((inside - kBorder) / footprint + 0.5f, 0.0f, 1.0f);
  const SamplePlaces place{&du, &dv, &footprint, 1};
  float picture = 0.75f;
  addMosaic(place, 0.083f, 0.061f, h, 0.3f, &picture);
  addMosaic(place, 0.019f, 0.023f, h + 1u, 0.16f, &picture);
  addSpots(place, 0.13f, h + 2u, 0.2f, &picture);
  brightness = 0.35f * (1.0f - picture_share) + picture * picture_share;
  return cover;
}

void hangPosters(double share, std::uint32_t seed, TextureSamples& samples) {
  for (int i = 0; i < samples.count; ++i) {
    float poster = 0.0f;
    const float cover =
        posterShare(share, samples.u[i], samples.v[i], samples.footprint[i], seed, poster);
    samples.brightness[i] += cover * (poster - samples.brightness[i]);
  }
}

/// The detail of a pattern (around 0) and the share of joints, for each sample.
struct PatternParts {
  float detail[TextureSamples::kCapacity];
  float joint[TextureSamples::kCapacity];
  float joint_brightness = 1.0f;
};

void layPlanks(const SamplePlaces& at, std::uint32_t seed, PatternParts& parts) {
  constexpr float kPlank = 0.14f;
  parts.joint_brightness = 0.6f;
  widenJoints(at.v, at.footprint, at.count, kPlank, 0.006f, parts.joint);
  addMosaic(at, 0.9f, kPlank, seed, 0.12f, parts.detail);
  float shifted[TextureSamples::kCapacity];
  for (int i = 0; i < at.count; ++i)
    shifted[i] = at.u[i] + 0.37f * std::floor(at.v[i] * (1.0f / kPlank));
  const SamplePlaces grain{shifted, at.v, at.footprint, at.count};
  addNoise(grain, 0.15f, 0.02f, 1.0f, 0.0f, seed + 60u, 0.09f, parts.detail);
  addNoise(grain, 0.04f, 0.008f, 1.0f, 0.0f, seed + 61u, 0.09f, parts.detail);
  addAllScales(at, seed + 62u, 0.05f, parts.detail);
  addSpots(at, 0.11f, seed + 63u, 0.15f, parts.detail);
}

void layTiles(const SamplePlaces& at, std::uint32_t seed, PatternParts& parts) {
  constexpr float kTile = 0.4f;
  constexpr float kJoint = 0.01f;
  parts.joint_brightness = 0.65f;
  widenJoints(at.u, at.footprint, at.count, kTile, kJoint, parts.joint);
  widenJoints(at.v, at.footprint, at.count, kTile, kJoint, parts.joint);
  addMosaic(at, kTile, kTile, seed, 0.07f, parts.detail);
  addAllScales(at, seed + 70u, 0.08f, parts.detail);
  addSpots(at, 0.09f, seed + 71u, 0.3f, parts.detail);
  addSpots(at, 0.025f, seed + 72u, 0.25f, parts.detail);
}

void layBricks(const SamplePlaces& at, std::uint32_t seed, PatternParts& parts) {
  constexpr float kCourse = 0.09f;
  constexpr float kBrick = 0.26f;
  constexpr float kJoint = 0.012f;
  parts.joint_brightness = 1.3f;
  float shifted[TextureSamples::kCapacity];
  for (int i = 0; i < at.count; ++i) {
    const auto course = static_cast<std::int32_t>(std::floor(at.v[i] * (1.0f / kCourse)));
    shifted[i] = at.u[i] + ((course & 1) == 0 ? 0.0f : 0.5f * kBrick);
  }
  widenJoints(at.v, at.footprint, at.count, kCourse, kJoint, parts.joint);
  widenJoints(shifted, at.footprint, at.count, kBrick, kJoint, parts.joint);
  addMosaic({shifted, at.v, at.footprint, at.count}, kBrick, kCourse, seed, 0.2f, parts.detail);
  addAllScales(at, seed + 80u, 0.09f, parts.detail);
}

}  // namespace

double valueNoise(double u, double v, std::uint32_t seed) {
  const std::int32_t iu = wholeOf(u);
  const std::int32_t iv = wholeOf(v);
  const double au = u - iu;
  const double av = v - iv;
  const double low = hashed(iu, iv, seed) * (1 - au) + hashed(iu + 1, iv, seed) * au;
  const double high = hashed(iu, iv + 1, seed) * (1 - au) + hashed(iu + 1, iv + 1, seed) * au;
  return low * (1 - av) + high * av;
}

double textureAt(const Material& material, double u, double v, double plain_share,
                 std::uint32_t seed) {
  constexpr double kPlainPatch = 0.7;
  if (plain_share > 0.0 &&
      hashed(wholeOf(u / kPlainPatch), wholeOf(v / kPlainPatch), seed + 19u) < plain_share)
    return 0.0;
  if (material.texture >= 1.0) return 1.0;
  const double stretch = valueNoise(u / 0.35, v / 0.35, seed + 17u);
  return std::clamp(material.texture + (1.0 - material.texture) * (2.0 * stretch - 1.0), 0.0, 1.0);
}

void computeBrightness(const Material& material, bool flat, std::uint32_t seed,
                       TextureSamples& samples) {
  if (samples.count == 0) return;
  PatternParts parts;
  std::fill_n(parts.detail, samples.count, 0.0f);
  std::fill_n(parts.joint, samples.count, 0.0f);
  const SamplePlaces at{samples.u, samples.v, samples.footprint, samples.count};
  switch (material.pattern) {
    case Pattern::Plain:
      addAllScales(at, seed, 0.05f, parts.detail);
      break;
    case Pattern::Speckles:
      addAllScales(at, seed, 0.11f, parts.detail);
      addSpots(at, 0.16f, seed + 50u, 0.22f, parts.detail);
      addSpots(at, 0.045f, seed + 51u, 0.16f, parts.detail);
      break;
    case Pattern::Planks:
      layPlanks(at, seed, parts);
      break;
    case Pattern::Tiles:
      layTiles(at, seed, parts);
      break;
    case Pattern::Bricks:
      layBricks(at, seed, parts);
      break;
  }
  for (int i = 0; i < samples.count; ++i) {
    const float joint = samples.contrast[i] > 0.0f ? parts.joint[i] : 0.0f;
    const float surface = kPlainBrightness + samples.contrast[i] * parts.detail[i];
    samples.brightness[i] = surface + joint * (parts.joint_brightness - surface);
  }
  if (flat && material.posters > 0.0) hangPosters(material.posters, seed, samples);
}

}  // namespace evaluation
}  // namespace planar_mapping
