// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/simulation/surface_shading.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "evaluation/simulation/scene.h"

namespace planar_mapping::evaluation {
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
double posterAt(double fraction, double u, double v, double footprint, std::uint32_t seed,
                double& brightness) {
  static const Tile picture = Tile()
                                  .pieces(16, 16, 0, 0.3f, 0, 0.0f)
                                  .pieces(4, 4, 0, 0.16f, 0, 0.0f)
                                  .spots(32, 0.2f)
                                  .finish();
  const std::int32_t iu = wholeOf(u);
  const std::int32_t iv = wholeOf(v);
  const std::uint64_t h = hashOf(iu, iv, seed + 7u);
  if (static_cast<double>(h & 0xFFFFu) / 65536.0 >= fraction) return 0.0;
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

/// How much there is to match at surface coordinates u, v (metres), in [0, 1]: surfaces with little
/// texture have stretches with more and with less; the fraction \p plain_fraction of all surface
/// has none.
double textureAt(const Material& material, double u, double v, double plain_fraction,
                 std::uint32_t seed) {
  constexpr double kPlainPatch = 0.7;
  if (plain_fraction > 0.0 &&
      hashed(wholeOf(u / kPlainPatch), wholeOf(v / kPlainPatch), seed + 19u) < plain_fraction)
    return 0.0;
  if (material.texture >= 1.0) return 1.0;
  if (material.texture <= 0.0) return 0.0;
  const double stretch = valueNoise(u / 0.35, v / 0.35, seed + 17u);
  return std::clamp(material.texture + (1.0 - material.texture) * (2.0 * stretch - 1.0), 0.0, 1.0);
}

/// Brightness of a surface, a factor around 1: an image of its pattern, tiled over the surface in
/// pieces that \p seed shuffles, averaged over a square of side \p footprint (metres, > 0).
/// \param contrast  of the pattern there, in [0, 1], see textureAt()
/// \param flat      posters hang on flat faces only
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

constexpr int kLargestStretch = 8;      ///< samples along a pixel's image on a grazed surface
constexpr double kSmallestSide = 1e-6;  ///< of a pixel's image, metres
constexpr double kSmallestCosine = 1e-3;

/// Textures repeat after this many metres: their lattices count in 32 bits.
constexpr double kTexturePeriod = 4096.0;

/// Surface coordinates (metres) and how they change along the surface, object frame.
struct SurfaceFrame {
  Vector3 normal = Vector3::Zero();
  Vector3 along_u = Vector3::Zero();  ///< gradient of u
  Vector3 along_v = Vector3::Zero();  ///< gradient of v
  double u = 0.0;
  double v = 0.0;
};

SurfaceFrame flatFrame(const SceneObject& object, int face, const Vector3& local) {
  SurfaceFrame frame;
  const int axis = face / 2;
  frame.normal[axis] = face % 2 == 0 ? -1.0 : 1.0;
  int axis_u = axis == 0 ? 1 : 0;
  int axis_v = axis == 2 ? 1 : 2;
  // Wood is cut along its longer side.
  if (object.material.pattern == Pattern::Planks && object.size[axis_v] > object.size[axis_u])
    std::swap(axis_u, axis_v);
  frame.u = local[axis_u];
  frame.v = local[axis_v];
  frame.along_u[axis_u] = 1.0;
  frame.along_v[axis_v] = 1.0;
  return frame;
}

SurfaceFrame roundFrame(const SceneObject& object, const Vector3& local) {
  SurfaceFrame frame;
  frame.normal = local;
  if (object.shape == Shape::Cylinder) frame.normal.z() = 0.0;
  frame.normal.normalize();
  const double radius = 0.5 * object.size.x();
  frame.u = radius * std::atan2(local.y(), local.x());
  frame.v = local.z();
  const double squared = std::max(local.head<2>().squaredNorm(), 1e-6);
  frame.along_u = radius / squared * Vector3(-local.y(), local.x(), 0.0);
  frame.along_v = Vector3::UnitZ();
  return frame;
}

std::uint32_t scaled(std::uint32_t color, double brightness) {
  std::uint32_t result = 0;
  for (const unsigned shift : {16u, 8u, 0u}) {
    const double channel = static_cast<double>(color >> shift & 0xFFu) * brightness;
    result |= static_cast<std::uint32_t>(std::clamp(channel, 0.0, 255.0) + 0.5) << shift;
  }
  return result;
}

}  // namespace

SurfaceShader::SurfaceShader(const ObjectView& view, int face, const PinholeCamera& camera,
                             double plain_fraction, bool colors)
    : view_(view),
      face_(face),
      pixel_right_(view.R_object_camera.col(0) / camera.fx),
      pixel_down_(view.R_object_camera.col(1) / camera.fy),
      plain_fraction_(plain_fraction),
      colors_(colors),
      seed_(static_cast<std::uint32_t>(view.index * 64 + face)) {}

SurfacePatch SurfaceShader::patchAt(double depth, const Vector3& ray) const {
  const SceneObject& object = *view_.object;
  const Vector3 direction = view_.R_object_camera * ray;
  const Vector3 local = view_.origin + depth * direction;
  const SurfaceFrame frame =
      face_ < kCurvedFace ? flatFrame(object, face_, local) : roundFrame(object, local);
  const double length = direction.norm();
  const double toward = -frame.normal.dot(direction);
  SurfacePatch patch;
  patch.incidence = std::clamp(toward / length, 0.0, 1.0);
  patch.u = std::fmod(frame.u, kTexturePeriod);
  patch.v = std::fmod(frame.v, kTexturePeriod);
  patch.texture = textureAt(object.material, patch.u, patch.v, plain_fraction_, seed_);
  if (!colors_) return patch;
  if (view_.scene->lamp) {
    patch.light = lampLight(local, frame.normal, direction);
  } else {
    const double side = frame.normal.dot(view_.light);
    patch.light = 0.62 + (side > 0.0 ? 0.33 : -0.12) * side;
  }

  // A step of one pixel moves the ray, and its end along the ray so that it stays on the surface.
  const double slope = std::max(toward, kSmallestCosine * length);
  const auto stepOnSurface = [&](const Vector3& step, double& u, double& v) {
    const Vector3 moved = depth * (step + direction * (frame.normal.dot(step) / slope));
    u = std::clamp(frame.along_u.dot(moved), -kTexturePeriod, kTexturePeriod);
    v = std::clamp(frame.along_v.dot(moved), -kTexturePeriod, kTexturePeriod);
  };
  double across_u = 0.0, across_v = 0.0, down_u = 0.0, down_v = 0.0;
  stepOnSurface(pixel_right_, across_u, across_v);
  stepOnSurface(pixel_down_, down_u, down_v);
  const double area = std::abs(across_u * down_v - across_v * down_u);
  const double across = across_u * across_u + across_v * across_v;
  const double down = down_u * down_u + down_v * down_v;
  const double longer = std::sqrt(std::max(across, down));
  patch.along_u = across > down ? across_u : down_u;
  patch.along_v = across > down ? across_v : down_v;
  patch.width =
      std::max({area / std::max(longer, kSmallestSide), longer / kLargestStretch, kSmallestSide});
  patch.samples = std::clamp(static_cast<int>(longer / patch.width + 0.5), 1, kLargestStretch);
  return patch;
}

double SurfaceShader::lampLight(const Vector3& local, const Vector3& normal,
                                const Vector3& direction) const {
  constexpr double kAmbient = 0.5;
  constexpr double kDirect = 0.45;    // of a surface that faces the lamp at the usual distance,
  constexpr double kUsual = 2.0;      // metres,
  constexpr double kStrongest = 2.0;  // and no more than so many times that
  constexpr double kMirror = 80.0;    // exponent of the reflection
  const Scene& scene = *view_.scene;
  const Pose& T_world_object = view_.object->T_world_object;
  const Vector3 point = T_world_object * local + 1e-4 * (T_world_object.linear() * normal);
  const Vector3 to_lamp = *scene.lamp - point;
  const double distance = to_lamp.norm();
  const Vector3 n = T_world_object.linear() * normal;
  const double facing = n.dot(to_lamp) / distance;
  if (facing <= 0.0) return kAmbient;
  for (const SceneObject& object : scene.objects) {
    double t = 0.0;
    int face = 0;
    if (object.isThere(view_.frame) && intersect(object, point, to_lamp, t, face) && t < 1.0)
      return kAmbient;
  }
  const double fall_off = std::min(kStrongest, kUsual * kUsual / (distance * distance));
  const Vector3 ray = (T_world_object.linear() * direction).normalized();
  const double mirrored = std::max(0.0, (ray - 2.0 * n.dot(ray) * n).dot(to_lamp) / distance);
  return kAmbient + kDirect * facing * fall_off +
         view_.object->material.gloss * std::pow(mirrored, kMirror);
}

std::uint32_t SurfaceShader::colorOf(const SurfacePatch& patch) const {
  const Material& material = view_.object->material;
  double sum = 0.0;
  for (int k = 0; k < patch.samples; ++k) {
    const double along = (k + 0.5) / patch.samples - 0.5;
    sum += brightnessAt(material, face_ < kCurvedFace, seed_, patch.u + along * patch.along_u,
                        patch.v + along * patch.along_v, patch.width, patch.texture);
  }
  return scaled(material.color, patch.light * sum / patch.samples);
}

}  // namespace planar_mapping::evaluation
