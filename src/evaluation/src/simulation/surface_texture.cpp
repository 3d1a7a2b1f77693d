// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/surface_texture.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace planar_mapping {
namespace evaluation {
namespace {

constexpr double kPlainBrightness = 0.97;  ///< of surface without texture
constexpr int kSide = 1024;                ///< of a tile, texels; a power of two
constexpr double kTexel = 0.004;           ///< metres
/// Pieces of this side are shuffled by multiples of the next, which all patterns repeat after.
constexpr double kPiece = 512 * kTexel;
constexpr double kShuffle = 128 * kTexel;

std::uint64_t hashOf(std::int64_t u, std::int64_t v, std::uint32_t seed) {
  std::uint64_t h = static_cast<std::uint64_t>(u) * 0x9E3779B97F4A7C15ULL;
  h ^= static_cast<std::uint64_t>(v) * 0xC2B2AE3D27D4EB4FULL + seed;
  h ^= h >> 29u;
  h *= 0xBF58476D1CE4E5B9ULL;
  return h ^ h >> 32u;
}

double hashed(std::int64_t u, std::int64_t v, std::uint32_t seed) {
  return static_cast<double>(hashOf(u, v, seed) & 0xFFFFFFu) / 16777215.0;
}

/// In [-1, 1].
float toneOf(int u, int v, std::uint32_t seed) {
  return static_cast<float>(2.0 * hashed(u, v, seed) - 1.0);
}

std::int32_t wholeOf(double value) {
  return static_cast<std::int32_t>(std::floor(value));
}

/// An image that repeats, around 0, with copies of half the side each. Lengths are texels.
class Tile {
 public:
  Tile() : levels_(1, std::vector<float>(kSide * kSide, 0.0f)) {}

  /// Smooth value noise; slopes are continuous, as creases along the lattice would be lines.
  Tile& noise(int cell_u, int cell_v, float gain) {
    const std::uint32_t seed = ++seed_;
    return paint([=](int u, int v, float& value) {
      const auto smooth = [](int at, int cell) {
        const float a = (static_cast<float>(at % cell) + 0.5f) / static_cast<float>(cell);
        return a * a * (3.0f - 2.0f * a);
      };
      const auto corner = [&](int right, int up) {
        return toneOf((u / cell_u + right) % (kSide / cell_u), (v / cell_v + up) % (kSide / cell_v),
                      seed);
      };
      const float a = smooth(u, cell_u);
      const float low = corner(0, 0) + a * (corner(1, 0) - corner(0, 0));
      const float high = corner(0, 1) + a * (corner(1, 1) - corner(0, 1));
      value += gain * (low + smooth(v, cell_v) * (high - low));
    });
  }
  /// Noise of every scale, each as strong as the others: there is something to match from near
  /// and from far.
  Tile& allScales(float gain) {
    for (const int cell : {128, 64, 16, 8, 4, 1}) noise(cell, cell, gain);
    return *this;
  }
  /// A round spot of one tone in each cell.
  Tile& spots(int cell, float gain) {
    const std::uint32_t seed = ++seed_;
    return paint([=](int u, int v, float& value) {
      const auto random = [&](std::uint32_t k) {
        return static_cast<float>(hashed(u / cell, v / cell, seed + 1000u * k));
      };
      const float radius = 0.1f + 0.25f * random(1);  // in units of the cell, like the rest
      const auto from = [&](int at, std::uint32_t k) {
        return (static_cast<float>(at % cell) + 0.5f) / static_cast<float>(cell) - radius -
               (1.0f - 2.0f * radius) * random(k);
      };
      if (std::hypot(from(u, 2), from(v, 3)) < radius)
        value += gain * toneOf(u / cell, v / cell, seed);
    });
  }
  /// Pieces of one tone each, in rows that are shifted, with joints of the value \p joint.
  Tile& pieces(int cell_u, int cell_v, int shift, float gain, int joint_width, float joint) {
    const std::uint32_t seed = ++seed_;
    return paint([=](int u, int v, float& value) {
      const int along = (u + shift * (v / cell_v)) % kSide;
      value += gain * toneOf(along / cell_u, v / cell_v, seed);
      if (along % cell_u < joint_width || v % cell_v < joint_width) value = joint;
    });
  }
  Tile& finish() {
    for (int side = kSide / 2; side > 0; side /= 2) {
      const std::vector<float>& fine = levels_.back();
      std::vector<float> coarse;
      for (int v = 0; v < side; ++v)
        for (int u = 0; u < side; ++u) {
          const float* corner = fine.data() + 4 * side * v + 2 * u;
          coarse.push_back(0.25f *
                           (corner[0] + corner[1] + corner[2 * side] + corner[2 * side + 1]));
        }
      levels_.push_back(std::move(coarse));
    }
    return *this;
  }

  /// Average over about the footprint; u, v and footprint in metres.
  double at(double u, double v, double footprint) const {
    const double level = std::clamp(std::log2(footprint / kTexel), 0.0, levels_.size() - 1.001);
    const auto fine = static_cast<std::size_t>(level);
    const double low = interpolated(fine, u, v);
    return low + (level - static_cast<double>(fine)) * (interpolated(fine + 1, u, v) - low);
  }

 private:
  template <typename Change>
  Tile& paint(const Change& change) {
    for (int v = 0; v < kSide; ++v)
      for (int u = 0; u < kSide; ++u)
        change(u, v, levels_[0][static_cast<std::size_t>(v * kSide + u)]);
    return *this;
  }
  double interpolated(std::size_t level, double u, double v) const {
    const int side = kSide >> level;
    const double per_texel = side / (kSide * kTexel);
    const double x = u * per_texel - 0.5;
    const double y = v * per_texel - 0.5;
    const std::int32_t column = wholeOf(x);
    const std::int32_t row = wholeOf(y);
    const auto texel = [&](int right, int up) {
      return static_cast<double>(levels_[level][static_cast<std::size_t>(
          ((row + up) & (side - 1)) * side + ((column + right) & (side - 1)))]);
    };
    const double low = texel(0, 0) + (x - column) * (texel(1, 0) - texel(0, 0));
    const double high = texel(0, 1) + (x - column) * (texel(1, 1) - texel(0, 1));
    return low + (y - row) * (high - low);
  }

  std::uint32_t seed_ = 0;
  std::vector<std::vector<float>> levels_;
};

const Tile& tileOf(Pattern pattern) {
  static const Tile plain = Tile().allScales(0.05f).finish();
  if (pattern == Pattern::Plain) return plain;
  static const Tile speckles = Tile().allScales(0.11f).spots(32, 0.22f).spots(8, 0.16f).finish();
  if (pattern == Pattern::Speckles) return speckles;
  static const Tile planks = Tile()
                                 .noise(32, 4, 0.09f)
                                 .noise(8, 2, 0.09f)
                                 .allScales(0.05f)
                                 .spots(32, 0.15f)
                                 .pieces(256, 32, 96, 0.12f, 2, -0.37f)
                                 .finish();
  if (pattern == Pattern::Planks) return planks;
  static const Tile tiles = Tile()
                                .allScales(0.08f)
                                .spots(16, 0.3f)
                                .spots(8, 0.25f)
                                .pieces(128, 128, 0, 0.07f, 3, -0.32f)
                                .finish();
  if (pattern == Pattern::Tiles) return tiles;
  static const Tile bricks = Tile().allScales(0.09f).pieces(64, 16, 32, 0.2f, 3, 0.33f).finish();
  return bricks;
}

/// A poster in some square metres: the fraction of the footprint that it covers, its brightness.
double posterAt(double share, double u, double v, double footprint, std::uint32_t seed,
                double& brightness) {
  static const Tile picture = Tile()
                                  .pieces(16, 16, 0, 0.3f, 0, 0.0f)
                                  .pieces(4, 4, 0, 0.16f, 0, 0.0f)
                                  .spots(32, 0.2f)
                                  .finish();
  const std::int32_t iu = wholeOf(u);
  const std::int32_t iv = wholeOf(v);
  const std::uint64_t h = hashOf(iu, iv, seed + 7u);
  if (static_cast<double>(h & 0xFFFFu) / 65536.0 >= share) return 0.0;
  const auto part = [h](unsigned shift) { return static_cast<double>(h >> shift & 0xFu) / 15.0; };
  const double half_u = 0.18 + 0.14 * part(16);
  const double half_v = 0.20 + 0.18 * part(20);
  const double du = u - iu - 0.5 - (0.48 - half_u) * (2.0 * part(24) - 1.0);
  const double dv = v - iv - 0.5 - (0.48 - half_v) * (2.0 * part(28) - 1.0);
  const double inside = std::min(half_u - std::abs(du), half_v - std::abs(dv));
  constexpr double kBorder = 0.015;
  const double shown = std::clamp((inside - kBorder) / footprint + 0.5, 0.0, 1.0);
  const double place = 5.0 * static_cast<double>(h >> 32u & 0xFFFFu);  // each shows another part
  brightness = 0.35 + shown * (0.4 + picture.at(u + place, v, footprint));
  return std::clamp(inside / footprint + 0.5, 0.0, 1.0);
}

double valueNoise(double u, double v, std::uint32_t seed) {
  const std::int32_t iu = wholeOf(u);
  const std::int32_t iv = wholeOf(v);
  const double au = u - iu;
  const double av = v - iv;
  const double low = hashed(iu, iv, seed) * (1 - au) + hashed(iu + 1, iv, seed) * au;
  const double high = hashed(iu, iv + 1, seed) * (1 - au) + hashed(iu + 1, iv + 1, seed) * au;
  return low * (1 - av) + high * av;
}

}  // namespace

double textureAt(const Material& material, double u, double v, double plain_share,
                 std::uint32_t seed) {
  constexpr double kPlainPatch = 0.7;
  if (plain_share > 0.0 &&
      hashed(wholeOf(u / kPlainPatch), wholeOf(v / kPlainPatch), seed + 19u) < plain_share)
    return 0.0;
  if (material.texture >= 1.0) return 1.0;
  if (material.texture <= 0.0) return 0.0;
  const double stretch = valueNoise(u / 0.35, v / 0.35, seed + 17u);
  return std::clamp(material.texture + (1.0 - material.texture) * (2.0 * stretch - 1.0), 0.0, 1.0);
}

double brightnessAt(const Material& material, bool flat, std::uint32_t seed, double u, double v,
                    double footprint, double contrast) {
  double brightness = kPlainBrightness;
  if (contrast > 0.0) {
    const std::uint64_t h = hashOf(wholeOf(u / kPiece), wholeOf(v / kPiece), seed);
    brightness += contrast * tileOf(material.pattern)
                                 .at(u + kShuffle * static_cast<double>(h & 7u),
                                     v + kShuffle * static_cast<double>(h >> 3u & 7u), footprint);
  }
  if (!flat || material.posters <= 0.0) return brightness;
  double poster = 0.0;
  const double cover = posterAt(material.posters, u, v, footprint, seed, poster);
  return brightness + cover * (poster - brightness);
}

}  // namespace evaluation
}  // namespace planar_mapping
