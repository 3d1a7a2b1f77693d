// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "ground_model.h"
#include "planar_mapping/core/simd.h"
#include "point_indices.h"

namespace planar_mapping::detail {
namespace {

/// All that the pass over the points needs, as plain numbers.
struct Kernel {
  float sensor[3];
  float normal[3];  ///< of the plane at the sensor, unit, upwards
  float height;
  float depth_axis[3];
  float forwards[3];
  float left[3];
  float threshold;
  float noise;  ///< band per metre of depth
  float foot;
  float wall_height;
  float columns_per_metre;
  float origin_x, origin_y, cells_per_metre;  ///< of the bends
  const float* pieces;                        ///< of the bends, null = flat
};

// Points are dealt with in blocks whose results stay in the first cache.
constexpr std::size_t kBlock = 1024;
struct Block {
  std::int32_t kind[kBlock];    ///< see Kind
  std::int32_t column[kBlock];  ///< of what a wall may be made of
};

enum Kind : std::int32_t {
  kElsewhere = 0,
  kGround = 1,     ///< in the band, and too low to be told from the ground
  kLowInWall = 2,  ///< in the band, ground unless something stands in its column
  kAboveLow = 3,   ///< over the band, in the lower half of wall_height
  kAboveHigh = 4,  ///< over the band, in the upper half
};

constexpr std::uint8_t kMostCounted = 255;

/// Columns over the ground are wrapped around: a point shares its column only with points beside
/// it and some that are kSide columns away, which should be out of sight.
constexpr std::int32_t kSide = 512;

inline __attribute__((always_inline)) float clamped(float value, float low, float high) {
  const float raised = value > low ? value : low;  // low for NaN, too
  return raised < high ? raised : high;
}

template <bool kBent, bool kNoisy>
inline __attribute__((always_inline)) std::size_t classifyBlock(const float* data,
                                                                std::size_t stride, std::size_t n,
                                                                const Kernel& kernel,
                                                                Block& block) {
  const Kernel k = kernel;
  constexpr auto kCells = static_cast<float>(GroundBends::kCells);
  std::int32_t finite = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const float* p = data + i * stride;
    const float px = p[0] - k.sensor[0];
    const float py = p[1] - k.sensor[1];
    const float pz = p[2] - k.sensor[2];
    const float x = k.forwards[0] * px + k.forwards[1] * py + k.forwards[2] * pz;
    const float y = k.left[0] * px + k.left[1] * py + k.left[2] * pz;
    float d = k.normal[0] * px + k.normal[1] * py + k.normal[2] * pz + k.height;
    if (kBent) {
      const float a = (x - k.origin_x) * k.cells_per_metre;
      const float b = (y - k.origin_y) * k.cells_per_metre;
      const auto column = static_cast<std::int32_t>(clamped(a, 0.0f, kCells - 1.0f));
      const auto row = static_cast<std::int32_t>(clamped(b, 0.0f, kCells - 1.0f));
      const std::int32_t cell = 3 * (row * GroundBends::kCells + column);
      const float bend = k.pieces[cell] + k.pieces[cell + 1] * x + k.pieces[cell + 2] * y;
      d -= (a >= 0.0f) & (b >= 0.0f) & (a < kCells) & (b < kCells) ? bend : 0.0f;
    }
    float band = k.threshold;
    if (kNoisy) {
      const float along = k.depth_axis[0] * px + k.depth_axis[1] * py + k.depth_axis[2] * pz;
      const float noisy = k.noise * __builtin_fabsf(along);
      band = noisy > band ? noisy : band;
    }
    const float foot = k.foot < band ? k.foot : band;
    // Counting comparisons instead of choosing leaves no branch in the loop.
    const std::int32_t under = (d <= foot ? 1 : 0) + (d <= band ? 1 : 0) +
                               (d <= band + 0.5f * k.wall_height ? 1 : 0) +
                               (d <= band + k.wall_height ? 1 : 0);
    const std::int32_t within = (under > 0 ? 1 : 0) & (d >= -band ? 1 : 0);
    block.kind[i] = within * (5 - under);
    // Positive before the truncation, and small enough for a float to tell columns apart.
    const float a = clamped(x * k.columns_per_metre, -16384.0f, 16384.0f);
    const float b = clamped(y * k.columns_per_metre, -16384.0f, 16384.0f);
    const auto column = static_cast<std::int32_t>(a + 32768.0f);
    const auto row = static_cast<std::int32_t>(b + 32768.0f);
    block.column[i] = (row & (kSide - 1)) * kSide + (column & (kSide - 1));
    // Zero times a number is zero unless the number is not finite.
    finite += (px * 0.0f == 0.0f) & (py * 0.0f == 0.0f) & (pz * 0.0f == 0.0f) ? 1 : 0;
  }
  return static_cast<std::size_t>(finite);
}

template <bool kBent, bool kNoisy>
inline __attribute__((always_inline)) std::size_t classifyStride(const float* data,
                                                                 std::size_t stride, std::size_t n,
                                                                 const Kernel& kernel,
                                                                 Block& block) {
  // Strides known at compile time are loaded with shuffles.
  if (stride == 4) return classifyBlock<kBent, kNoisy>(data, 4, n, kernel, block);
  if (stride == 8) return classifyBlock<kBent, kNoisy>(data, 8, n, kernel, block);
  return classifyBlock<kBent, kNoisy>(data, stride, n, kernel, block);
}

/// \return number of finite points
PLANAR_MAPPING_MULTIVERSION
std::size_t classify(const float* data, std::size_t stride, std::size_t n, const Kernel& kernel,
                     Block& block) {
  if (kernel.pieces) {
    return kernel.noise > 0.0f ? classifyStride<true, true>(data, stride, n, kernel, block)
                               : classifyStride<true, false>(data, stride, n, kernel, block);
  }
  return kernel.noise > 0.0f ? classifyStride<false, true>(data, stride, n, kernel, block)
                             : classifyStride<false, false>(data, stride, n, kernel, block);
}

struct Column {
  // Counted up to 255, so that the columns fit into the cache.
  std::uint8_t low = 0;    ///< points in the band that may be a foot
  std::uint8_t above = 0;  ///< points over the band
  std::uint8_t high = 0;   ///< of these, in the upper half of wall_height

  /// Something stands here: not just noise over the band, and it reaches up.
  bool hasWall() const { return high >= 1 && above >= 3 && 2 * above >= low; }
};

Kernel makeKernel(const GroundParams& params, const GroundFrame& frame, const GroundPlane& plane,
                  const GroundBends& bends) {
  const Vector3 normal =
      plane.cosine() * (frame.axes.transpose() * Vector3(-plane.slope_x, -plane.slope_y, 1.0));
  Kernel kernel;
  for (int i = 0; i < 3; ++i) {
    kernel.sensor[i] = static_cast<float>(frame.sensor[i]);
    kernel.normal[i] = static_cast<float>(normal[i]);
    kernel.depth_axis[i] = static_cast<float>(frame.depth_axis[i]);
    kernel.forwards[i] = static_cast<float>(frame.axes(0, i));
    kernel.left[i] = static_cast<float>(frame.axes(1, i));
  }
  kernel.height = static_cast<float>(plane.height());
  kernel.threshold = static_cast<float>(frame.distance_threshold);
  kernel.noise = static_cast<float>(frame.noise_per_depth_and_height * plane.height());
  kernel.wall_height = static_cast<float>(params.wall_height);
  // Without a search for walls nothing in the band is left to be judged.
  kernel.foot = params.wall_height > 0.0 ? static_cast<float>(params.wall_foot_threshold) : 1e9f;
  kernel.columns_per_metre = static_cast<float>(1.0 / params.wall_cell);
  bends.describe(kernel.origin_x, kernel.origin_y, kernel.cells_per_metre, kernel.pieces);
  return kernel;
}

}  // namespace

void labelGround(const PointsView& points, const Indices* indices, const GroundParams& params,
                 const GroundFrame& frame, const GroundPlane& plane, const GroundBends& bends,
                 Ground& ground) {
  const Kernel kernel = makeKernel(params, frame, plane, bends);
  const std::size_t n = countOf(points, indices);
  ground.is_ground.assign(n, 0);
  std::vector<Column> columns(kSide * kSide);
  struct Undecided {
    std::size_t position;
    std::int32_t column;
  };
  std::vector<Undecided> undecided;
  std::vector<float> gathered(indices ? 3 * kBlock : 0);
  Block block;
  std::size_t finite = 0;
  std::size_t on_ground = 0;
  for (std::size_t first = 0; first < n; first += kBlock) {
    const std::size_t count = std::min(kBlock, n - first);
    if (indices) {
      for (std::size_t i = 0; i < count; ++i) {
        std::copy_n(points[at(indices, first + i)], 3, gathered.data() + 3 * i);
      }
      finite += classify(gathered.data(), 3, count, kernel, block);
    } else {
      finite += classify(points[first], points.stride, count, kernel, block);
    }
    for (std::size_t i = 0; i < count; ++i) {
      const std::int32_t kind = block.kind[i];
      ground.is_ground[first + i] = kind == kGround ? 1 : 0;
      on_ground += kind == kGround ? 1 : 0;
      if (kind <= kGround) continue;
      Column& column = columns[block.column[i]];
      if (kind == kLowInWall) {
        column.low += column.low < kMostCounted ? 1 : 0;
        undecided.push_back({first + i, block.column[i]});
      } else {
        column.above += column.above < kMostCounted ? 1 : 0;
        column.high += kind == kAboveHigh && column.high < kMostCounted ? 1 : 0;
      }
    }
  }
  for (const Undecided& point : undecided) {
    if (columns[point.column].hasWall()) {
      ++ground.diagnostics.wall_foot_points;
    } else {
      ground.is_ground[point.position] = 1;
      ++on_ground;
    }
  }
  ground.diagnostics.points_not_finite = n - finite;
  ground.diagnostics.ground_points = on_ground;
}

}  // namespace planar_mapping::detail
