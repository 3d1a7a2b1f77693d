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

/// All that the passes over the points need, as plain numbers.
struct Kernel {
  float sensor[3];
  float normal[3];  ///< of the plane at the sensor, unit, upwards
  float offset;
  float depth_axis[3];
  float threshold;
  float noise;  ///< band per metre of depth
  float below;  ///< how far under the band points are looked at
  float above;
  bool depth_is_distance;
};

constexpr float kFarAway = 1e30f;

/// Distance to the plane of one point, kFarAway if it cannot matter. \p band is its threshold.
inline __attribute__((always_inline)) float distanceOf(const float* p, const Kernel& k, float& band,
                                                       int& finite) {
  const float x = p[0] - k.sensor[0];
  const float y = p[1] - k.sensor[1];
  const float z = p[2] - k.sensor[2];
  const float w = k.normal[0] * x + k.normal[1] * y + k.normal[2] * z + k.offset;
  const float along = k.depth_axis[0] * x + k.depth_axis[1] * y + k.depth_axis[2] * z;
  const float depth =
      k.depth_is_distance ? __builtin_sqrtf(x * x + y * y + z * z) : __builtin_fabsf(along);
  const float noisy = k.noise * depth;
  band = noisy > k.threshold ? noisy : k.threshold;
  // Zero times a number is zero unless the number is not finite.
  finite = (x * 0.0f == 0.0f) & (y * 0.0f == 0.0f) & (z * 0.0f == 0.0f);
  return (w >= -band - k.below) & (w <= band + k.above) ? w : kFarAway;
}

inline __attribute__((always_inline)) std::size_t distancesOf(const float* data, std::size_t stride,
                                                              std::size_t n, const Kernel& kernel,
                                                              float* out) {
  const Kernel k = kernel;
  int finite_points = 0;
  for (std::size_t i = 0; i < n; ++i) {
    float band = 0.0f;
    int finite = 0;
    out[i] = distanceOf(data + i * stride, k, band, finite);
    finite_points += finite;
  }
  return static_cast<std::size_t>(finite_points);
}

/// \return number of finite points
PLANAR_MAPPING_MULTIVERSION
std::size_t distances(const float* data, std::size_t stride, std::size_t n, const Kernel& kernel,
                      float* out) {
  if (stride == 4) return distancesOf(data, 4, n, kernel, out);
  if (stride == 8) return distancesOf(data, 8, n, kernel, out);
  return distancesOf(data, stride, n, kernel, out);
}

/// Columns over the ground, wrapped around: a point shares its column only with points beside it
/// and some that are kSide columns away.
class Columns {
 public:
  explicit Columns(double side)
      : per_cell_(static_cast<float>(1.0 / side)), counts_(kSide * kSide) {}
  std::uint32_t of(float x, float y) const {
    const auto a = static_cast<std::uint32_t>(static_cast<std::int64_t>(std::floor(x * per_cell_)));
    const auto b = static_cast<std::uint32_t>(static_cast<std::int64_t>(std::floor(y * per_cell_)));
    return (b % kSide) * kSide + a % kSide;
  }
  void addGround(std::uint32_t column) { ++counts_[column].ground; }
  void addAbove(std::uint32_t column, float over_band, float wall_height) {
    Count& count = counts_[column];
    ++count.above;
    if (over_band > 0.5f * wall_height) ++count.high;
  }
  /// Something stands in this column: not just noise over the band, and it reaches up.
  bool hasWall(std::uint32_t column) const {
    const Count& count = counts_[column];
    return count.high >= 1 && count.above >= 3 && 4 * count.above >= count.ground;
  }

 private:
  static constexpr std::uint32_t kSide = 256;
  struct Count {
    std::uint32_t ground = 0;
    std::uint32_t above = 0;
    std::uint32_t high = 0;
  };
  float per_cell_;
  std::vector<Count> counts_;
};

}  // namespace

void labelGround(const PointsView& points, const Indices* indices, const GroundParams& params,
                 const GroundFrame& frame, const GroundPlane& plane, const GroundBends& bends,
                 Ground& ground) {
  const std::size_t n = countOf(points, indices);
  const double cosine = plane.cosine();
  const Vector3 normal =
      cosine * (frame.axes.transpose() * Vector3(-plane.slope_x, -plane.slope_y, 1.0));
  Kernel kernel;
  for (int i = 0; i < 3; ++i) {
    kernel.sensor[i] = static_cast<float>(frame.sensor[i]);
    kernel.normal[i] = static_cast<float>(normal[i]);
    kernel.depth_axis[i] = static_cast<float>(frame.depth_axis[i]);
  }
  kernel.offset = static_cast<float>(plane.height());
  kernel.threshold = static_cast<float>(frame.distance_threshold);
  kernel.noise = static_cast<float>(frame.noise_per_depth_and_height * plane.height());
  kernel.depth_is_distance = frame.depth_axis.isZero(0.0) && kernel.noise > 0.0f;
  kernel.below = bends.largest();
  kernel.above = bends.largest() + static_cast<float>(params.wall_height);

  std::vector<float> distance(n);
  std::size_t finite = 0;
  if (indices) {
    for (std::size_t k = 0; k < n; ++k) {
      float band = 0.0f;
      int is_finite = 0;
      distance[k] = distanceOf(points[at(indices, k)], kernel, band, is_finite);
      finite += static_cast<std::size_t>(is_finite);
    }
  } else {
    finite = distances(points.data, points.stride, n, kernel, distance.data());
  }
  ground.diagnostics.points_not_finite = n - finite;

  // Now the few that can matter: the local ground, and what stands in their column.
  ground.is_ground.assign(n, 0);
  Columns columns(params.wall_cell);
  std::vector<std::uint32_t> close;  // positions of ground points
  std::vector<std::uint32_t> column_of;
  std::vector<float> offset_of;
  const bool look_for_walls = params.wall_height > 0.0;
  float axis_x[3], axis_y[3];
  for (int i = 0; i < 3; ++i) {
    axis_x[i] = static_cast<float>(frame.axes(0, i));
    axis_y[i] = static_cast<float>(frame.axes(1, i));
  }
  for (std::size_t k = 0; k < n; ++k) {
    if (distance[k] == kFarAway) continue;
    const float* p = points[at(indices, k)];
    float band = 0.0f;
    int is_finite = 0;
    distanceOf(p, kernel, band, is_finite);
    const float dx = p[0] - kernel.sensor[0];
    const float dy = p[1] - kernel.sensor[1];
    const float dz = p[2] - kernel.sensor[2];
    const float x = axis_x[0] * dx + axis_x[1] * dy + axis_x[2] * dz;
    const float y = axis_y[0] * dx + axis_y[1] * dy + axis_y[2] * dz;
    float d = distance[k];
    if (!bends.isFlat()) {
      const float* c = bends.coefficients(x, y);
      d -= c[0] + c[1] * x + c[2] * y;
    }
    if (d < -band) continue;
    if (d <= band) {
      ground.is_ground[k] = 1;
      if (!look_for_walls) continue;
      const std::uint32_t column = columns.of(x, y);
      columns.addGround(column);
      close.push_back(static_cast<std::uint32_t>(k));
      column_of.push_back(column);
      offset_of.push_back(d);
    } else if (look_for_walls && d <= band + static_cast<float>(params.wall_height)) {
      columns.addAbove(columns.of(x, y), d - band, static_cast<float>(params.wall_height));
    }
  }
  const auto foot = static_cast<float>(params.wall_foot_threshold);
  for (std::size_t i = 0; i < close.size(); ++i) {
    if (offset_of[i] <= foot || !columns.hasWall(column_of[i])) continue;
    ground.is_ground[close[i]] = 0;
    ++ground.diagnostics.wall_foot_points;
  }
  ground.diagnostics.ground_points = static_cast<std::size_t>(
      std::count(ground.is_ground.begin(), ground.is_ground.end(), std::uint8_t{1}));
}

}  // namespace planar_mapping::detail
