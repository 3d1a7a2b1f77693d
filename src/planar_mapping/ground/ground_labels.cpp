// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>

#include "planar_mapping/base/gather_points.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/point_indices.h"
#include "planar_mapping/base/simd.h"
#include "planar_mapping/ground/ground_model.h"

namespace planar_mapping::detail {
namespace {

/// All that the pass over the points needs, as plain numbers.
struct Kernel {
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
  float origin, cells_per_metre;  ///< of the bends
  const float* pieces;            ///< of the bends, null = flat
};

// Points are dealt with in blocks that stay in the first cache.
constexpr std::size_t kBlock = 512;
struct Block {
  float x[kBlock], y[kBlock], z[kBlock];  ///< of the point, then forwards and left of the sensor
  float d[kBlock], band[kBlock];          ///< height over the ground and what counts as on it
  float a[kBlock], b[kBlock];             ///< place on the grid of the bends
  std::int32_t kind[kBlock];              ///< see Kind
  std::int32_t column[kBlock];            ///< of what a wall may be made of
  std::uint8_t is_ground[kBlock];         ///< 1 where kind is kGround
  std::size_t finite = 0;                 ///< points
  std::size_t on_ground = 0;              ///< points of kGround
};

enum Kind : std::int32_t {
  kElsewhere = 0,
  kGround = 1,     ///< in the band, and too low to be told from the ground
  kLowInWall = 2,  ///< in the band, ground unless something stands in its column
  kAboveLow = 3,   ///< over the band, in the lower half of wall_height
  kAboveHigh = 4,  ///< over the band, in the upper half
};

constexpr std::uint8_t kMaxCounted = 255;

/// Columns over the ground are wrapped around: a point shares its column only with points beside
/// it and some that are kSide columns away, which should be out of sight.
constexpr std::int32_t kSide = 512;

inline __attribute__((always_inline)) float clamped(float value, float low, float high) {
  const float raised = value > low ? value : low;  // low for NaN, too
  return raised < high ? raised : high;
}

inline __attribute__((always_inline)) std::int32_t floorOf(float value) {
  const auto truncated = static_cast<std::int32_t>(value);
  return truncated - (static_cast<float>(truncated) > value ? 1 : 0);
}

// Several short loops: in one, the compiler finds comparisons that decide each other and leaves
// branches.
PLANAR_MAPPING_MULTIVERSION
void classify(std::size_t n, const Kernel& kernel, Block& block) {
  const Kernel k = kernel;
  std::int32_t finite = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const float px = block.x[i];
    const float py = block.y[i];
    const float pz = block.z[i];
    const float along = k.depth_axis[0] * px + k.depth_axis[1] * py + k.depth_axis[2] * pz;
    block.x[i] = k.forwards[0] * px + k.forwards[1] * py + k.forwards[2] * pz;
    block.y[i] = k.left[0] * px + k.left[1] * py + k.left[2] * pz;
    block.d[i] = k.normal[0] * px + k.normal[1] * py + k.normal[2] * pz + k.height;
    const float noisy = k.noise * __builtin_fabsf(along);
    block.band[i] = noisy > k.threshold ? noisy : k.threshold;
    // Zero times a number is zero unless the number is not finite.
    finite += (px * 0.0f == 0.0f) & (py * 0.0f == 0.0f) & (pz * 0.0f == 0.0f) ? 1 : 0;
  }
  block.finite = static_cast<std::size_t>(finite);
  if (k.pieces) {
    constexpr auto kCells = static_cast<float>(GroundBends::kCells);
    for (std::size_t i = 0; i < n; ++i) {
      // What is outside falls on the border.
      block.a[i] = clamped((block.x[i] - k.origin) * k.cells_per_metre, -1.0f, kCells);
      block.b[i] = clamped((block.y[i] - k.origin) * k.cells_per_metre, -1.0f, kCells);
    }
    for (std::size_t i = 0; i < n; ++i) {
      block.column[i] = 3 * (floorOf(block.b[i]) * GroundBends::kSide + floorOf(block.a[i]));
    }
    const float* pieces = k.pieces + 3 * (GroundBends::kSide + 1);
    for (std::size_t i = 0; i < n; ++i) {
      const float* piece = pieces + block.column[i];
      block.d[i] -= piece[0] + piece[1] * block.x[i] + piece[2] * block.y[i];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    const float d = block.d[i];
    const float band = block.band[i];
    const float foot = k.foot < band ? k.foot : band;
    // Counting comparisons instead of choosing leaves no branch in the loop.
    const std::int32_t under = (d <= foot ? 1 : 0) + (d <= band ? 1 : 0) +
                               (d <= band + 0.5f * k.wall_height ? 1 : 0) +
                               (d <= band + k.wall_height ? 1 : 0);
    const std::int32_t within = (under > 0 ? 1 : 0) & (d >= -band ? 1 : 0);
    block.kind[i] = within * (5 - under);
  }
  for (std::size_t i = 0; i < n; ++i) {
    // Positive before the truncation, and small enough for a float to tell columns apart.
    const float a = clamped(block.x[i] * k.columns_per_metre, -16384.0f, 16384.0f);
    const float b = clamped(block.y[i] * k.columns_per_metre, -16384.0f, 16384.0f);
    const auto column = static_cast<std::int32_t>(a + 32768.0f);
    const auto row = static_cast<std::int32_t>(b + 32768.0f);
    block.column[i] = (row & (kSide - 1)) * kSide + (column & (kSide - 1));
  }
  std::int32_t on_ground = 0;
  for (std::size_t i = 0; i < n; ++i) {
    block.is_ground[i] = block.kind[i] == kGround ? 1 : 0;
    on_ground += block.kind[i] == kGround ? 1 : 0;
  }
  block.on_ground = static_cast<std::size_t>(on_ground);
}

struct Column {
  // Counted up to 255, so that the columns fit into the cache.
  std::uint8_t low = 0;    ///< points in the band that may be a foot
  std::uint8_t above = 0;  ///< points over the band
  std::uint8_t high = 0;   ///< of these, in the upper half of wall_height

  /// Something stands here: not just noise over the band, and it reaches up.
  bool hasWall() const { return high >= 1 && above >= 3 && 2 * above >= low; }
};

/// Of three bytes each, counted up to 255.
PLANAR_MAPPING_MULTIVERSION
void addCounts(const std::uint8_t* __restrict from, std::uint8_t* __restrict to, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    const int sum = to[i] + from[i];
    to[i] = static_cast<std::uint8_t>(sum < kMaxCounted ? sum : kMaxCounted);
  }
}

Kernel makeKernel(const GroundParams& params, const GroundFrame& frame, const GroundPlane& plane,
                  const GroundBends& bends) {
  const Vector3 normal =
      plane.cosine() * (frame.axes.transpose() * Vector3(-plane.slope_x, -plane.slope_y, 1.0));
  Kernel kernel;
  for (int i = 0; i < 3; ++i) {
    kernel.normal[i] = static_cast<float>(normal[i]);
    kernel.depth_axis[i] = static_cast<float>(frame.depth_axis[i]);
    kernel.forwards[i] = static_cast<float>(frame.axes(0, i));
    kernel.left[i] = static_cast<float>(frame.axes(1, i));
  }
  kernel.height = static_cast<float>(plane.height());
  kernel.threshold = static_cast<float>(frame.distance_threshold);
  kernel.noise = static_cast<float>(frame.noise_per_depth_and_height * plane.height());
  kernel.wall_height = static_cast<float>(params.wall_height);
  // Without a search for walls all of the band is ground.
  kernel.foot = params.wall_height > 0.0 ? static_cast<float>(params.wall_foot_threshold) : 1e9f;
  kernel.columns_per_metre = static_cast<float>(1.0 / params.wall_cell);
  kernel.origin = bends.origin;
  kernel.cells_per_metre = bends.cells_per_metre;
  kernel.pieces = bends.pieces.empty() ? nullptr : bends.pieces.data();
  return kernel;
}

/// A stretch of the points, labelled as far as that goes without the others.
class Stretch {
 public:
  Stretch() : columns_(kSide * kSide) {}

  /// Points [first, last), with one label each.
  void label(const PointsView& points, const Indices* indices, const Kernel& kernel,
             std::size_t first, std::size_t last, std::uint8_t* is_ground) {
    Block block = {};
    for (; first < last; first += kBlock) {
      const std::size_t count = std::min(kBlock, last - first);
      gatherPoints(indices ? points.data : points[first], points.stride,
                   indices ? indices->data() + first : nullptr, count, block.x, block.y, block.z);
      classify(count, kernel, block);
      finite_ += block.finite;
      on_ground_ += block.on_ground;
      std::copy_n(block.is_ground, count, is_ground + first);
      for (std::size_t k = 0; k < count; ++k) {
        if (block.kind[k] > kGround) countOther(first, block, k);
      }
    }
  }
  /// Adds what the other has counted: as if one had looked at all its points, too.
  void addColumns(const Stretch& other) {
    static_assert(sizeof(Column) == 3, "bytes one after the other");
    addCounts(&other.columns_.front().low, &columns_.front().low, 3 * columns_.size());
  }
  /// Decides by the columns of all points what is left.
  void decide(const Stretch& all, Ground& ground) const {
    for (const Undecided& point : undecided_) {
      if (all.columns_[point.column].hasWall()) {
        ++ground.diagnostics.wall_foot_points;
      } else {
        ground.is_ground[point.position] = 1;
        ++ground.diagnostics.ground_points;
      }
    }
    ground.diagnostics.ground_points += on_ground_;
    ground.diagnostics.points_not_measured -= finite_;
  }

 private:
  struct Undecided {
    std::size_t position;
    std::int32_t column;
  };

  void countOther(std::size_t first, const Block& block, std::size_t i) {
    const std::int32_t kind = block.kind[i];
    Column& column = columns_[block.column[i]];
    if (kind == kLowInWall) {
      column.low += column.low < kMaxCounted ? 1 : 0;
      undecided_.push_back({first + i, block.column[i]});
    } else {
      column.above += column.above < kMaxCounted ? 1 : 0;
      column.high += kind == kAboveHigh && column.high < kMaxCounted ? 1 : 0;
    }
  }

  std::vector<Column> columns_;
  std::vector<Undecided> undecided_;
  std::size_t finite_ = 0;
  std::size_t on_ground_ = 0;
};

}  // namespace

void labelGround(const PointsView& points, const Indices* indices, const GroundParams& params,
                 const GroundFrame& frame, const GroundPlane& plane, const GroundBends& bends,
                 Ground& ground) {
  // Each stretch clears and adds up columns of its own: more of them do not pay.
  constexpr std::size_t kMaxStretches = 4;
  constexpr std::size_t kMinPoints = 1 << 15;
  const Kernel kernel = makeKernel(params, frame, plane, bends);
  const std::size_t n = countOf(points, indices);
  ground.is_ground.resize(n);
  const std::size_t threads = std::min<std::size_t>(resolveThreads(params.threads), kMaxStretches);
  std::vector<Stretch> stretches(std::clamp<std::size_t>(n / kMinPoints, 1, threads));
  const auto begin = [&](std::size_t i) { return n * i / stretches.size() / kBlock * kBlock; };
  parallelFor(stretches.size(), params.threads, [&](std::size_t i) {
    const std::size_t last = i + 1 < stretches.size() ? begin(i + 1) : n;
    stretches[i].label(points, indices, kernel, begin(i), last, ground.is_ground.data());
  });
  // Counts that stop at 255 are the same however the points were divided.
  for (std::size_t i = 1; i < stretches.size(); ++i) stretches[0].addColumns(stretches[i]);
  ground.diagnostics.points_not_measured = n;
  ground.diagnostics.ground_points = 0;
  for (const Stretch& stretch : stretches) stretch.decide(stretches[0], ground);
}

}  // namespace planar_mapping::detail
