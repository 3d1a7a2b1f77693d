// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/geometry/cloud_scale.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "base/point_indices.h"
#include "planar_mapping/core/base/detail/marked_positions.h"
#include "planar_mapping/core/base/detail/simd.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/geometry/detail/angles.h"

namespace planar_mapping {
namespace {

constexpr std::size_t kLargestSample = 100000;  // points that are looked at
constexpr double kOutlierFraction = 0.01;       // at either end of each axis
constexpr int kCellsAlongAxis = 64;             // of the grid that measures the surface
constexpr float kFarthest = 1e12f;              // along an axis: squares stay finite

bool isUsable(const PointsView& points, std::size_t i) {
  const float* p = points[i];
  return points.isMeasured(i) && std::abs(p[0]) <= kFarthest && std::abs(p[1]) <= kFarthest &&
         std::abs(p[2]) <= kFarthest;
}

double quantile(std::vector<float>& values, double fraction) {
  const auto rank = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

/// The box of a cloud without its outliers. \param values  of its points, by axis; reordered
void boundsOf(std::vector<float> (&values)[3], Vector3& low, Vector3& high) {
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = quantile(values[axis], kOutlierFraction);
    high[axis] = quantile(values[axis], 1.0 - kOutlierFraction);
  }
}

/// Square root of the area that a point stands for: coarse cells are full of surface.
struct Spacing {
  double mean = 0.0;    ///< of the whole cloud
  double median = 0.0;  ///< over the points, of what those in a cell share
};

Spacing spacingOf(const std::vector<Vector3>& sample, const Vector3& low, double side,
                  std::size_t points) {
  // The median of Poisson counts weighted by points is so much above their mean.
  constexpr double kMedianAboveMean = 0.7;
  Spacing spacing;
  if (!(side > 0.0)) return spacing;
  const double cell = side / kCellsAlongAxis;
  std::vector<std::uint32_t> points_in(
      static_cast<std::size_t>(kCellsAlongAxis) * kCellsAlongAxis * kCellsAlongAxis, 0);
  std::vector<std::size_t> cells;
  std::size_t all = 0;
  for (const Vector3& p : sample) {
    std::size_t index = 0;
    bool inside = true;
    for (int axis = 0; axis < 3; ++axis) {
      const double c = (p[axis] - low[axis]) / cell;
      inside = inside && c >= 0.0 && c <= kCellsAlongAxis;
      index =
          index * kCellsAlongAxis +
          (inside ? std::min<std::size_t>(static_cast<std::size_t>(c), kCellsAlongAxis - 1) : 0);
    }
    if (!inside) continue;
    ++all;
    if (points_in[index]++ == 0) cells.push_back(index);
  }
  spacing.mean = cell * std::sqrt(static_cast<double>(cells.size()) / static_cast<double>(points));
  std::sort(cells.begin(), cells.end(),
            [&](std::size_t a, std::size_t b) { return points_in[a] > points_in[b]; });
  std::size_t seen = 0;
  for (const std::size_t index : cells) {
    seen += points_in[index];
    if (2 * seen < all) continue;
    const double sampled = static_cast<double>(sample.size()) / static_cast<double>(points);
    spacing.median = cell * std::sqrt(sampled / (points_in[index] - kMedianAboveMean));
    break;
  }
  return spacing;
}

/// Median over cells of a side of the RMS distance of their points from their plane. Cells that
/// hold but the fringe of a surface do not count.
std::optional<double> noiseIn(const std::vector<Vector3>& sample, const Vector3& low, double side) {
  constexpr std::ptrdiff_t kMinPoints = 12;  // that tell a plane from its noise
  constexpr double kMinFractionOfMean = 0.25;
  struct Place {
    std::uint64_t cell;
    std::size_t point;
  };
  std::vector<Place> places;
  places.reserve(sample.size());
  for (std::size_t i = 0; i < sample.size(); ++i) {
    const Vector3 p = (sample[i] - low) / side;
    std::uint64_t cell = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double c = std::floor(std::clamp(p[axis], -1e6, 1e6));
      cell = cell << 21u | (static_cast<std::uint64_t>(c + 1e6) & 0x1FFFFFu);
    }
    places.push_back({cell, i});
  }
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.point < b.point;
  });
  std::vector<float> residuals;
  std::vector<double> counts;
  double total = 0.0;
  for (auto first = places.begin(); first != places.end();) {
    auto last = first;
    Vector3 sum = Vector3::Zero();
    Matrix3 squares = Matrix3::Zero();
    for (; last != places.end() && last->cell == first->cell; ++last) {
      const Vector3 d = sample[last->point] - sample[first->point];
      sum += d;
      squares += d * d.transpose();
    }
    if (last - first >= kMinPoints) {
      const auto n = static_cast<double>(last - first);
      const Matrix3 covariance = squares / n - sum * sum.transpose() / (n * n);
      Eigen::SelfAdjointEigenSolver<Matrix3> solver;
      solver.computeDirect(covariance, Eigen::EigenvaluesOnly);
      residuals.push_back(static_cast<float>(std::sqrt(std::max(solver.eigenvalues()[0], 0.0))));
      counts.push_back(n);
      total += n;
    }
    first = last;
  }
  if (residuals.empty()) return std::nullopt;
  const double min_count = kMinFractionOfMean * total / static_cast<double>(residuals.size());
  std::vector<float> full;
  for (std::size_t i = 0; i < residuals.size(); ++i)
    if (counts[i] >= min_count) full.push_back(residuals[i]);
  return quantile(full, 0.5);
}

/// In cells as small as hold enough points, and large against the noise, which they cut off. Of two
/// grids the one that cuts through fewer surfaces counts.
double noiseOf(const std::vector<Vector3>& sample, const Vector3& low, double spacing) {
  constexpr double kSpacings = 6.0;
  constexpr double kNoises = 6.0;
  constexpr int kMaxDoublings = 4;
  if (!(spacing > 0.0)) return 0.0;
  double noise = 0.0;
  double side = kSpacings * spacing;
  for (int i = 0; i <= kMaxDoublings; ++i, side *= 2.0) {
    const std::optional<double> one = noiseIn(sample, low, side);
    const std::optional<double> other = noiseIn(sample, low - Vector3::Constant(0.5 * side), side);
    noise = std::min(one.value_or(other.value_or(0.0)), other.value_or(one.value_or(0.0)));
    if (kNoises * noise <= side) break;
  }
  return noise;
}

/// Of the points, those more than \p behind times as far as the nearest one in their direction; of
/// large clouds in some of the directions.
/// \param degrees  width of a direction
double hiddenFraction(const PointsView& points, const Indices* indices, double degrees,
                      double behind) {
  constexpr std::uint64_t kMix = 0x9E3779B97F4A7C15ULL;
  struct Sight {
    std::int32_t direction;
    float range;
  };
  const std::size_t n = detail::countOf(points, indices);
  const std::uint64_t every = n / kLargestSample + 1;
  const double width = degrees * kRadiansPerDegree;
  std::vector<Sight> sights;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = detail::at(indices, k);
    if (!isUsable(points, i)) continue;
    // Rings of equal height, cut into pieces of equal width.
    const Vector3 p = points.point(i);
    const double range = p.norm();
    const double ring = std::floor(std::asin(p.z() / range) / width);
    const double piece =
        std::floor(std::atan2(p.y(), p.x()) * std::cos((ring + 0.5) * width) / width);
    const auto direction =
        static_cast<std::int32_t>(ring) * 10000 + static_cast<std::int32_t>(piece);
    if ((static_cast<std::uint64_t>(direction) * kMix >> 32u) % every != 0) continue;
    sights.push_back({direction, static_cast<float>(range)});
  }
  std::sort(sights.begin(), sights.end(), [](const Sight& a, const Sight& b) {
    return a.direction != b.direction ? a.direction < b.direction : a.range < b.range;
  });
  std::size_t hidden = 0;
  double nearest = 0.0;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    if (i == 0 || sights[i].direction != sights[i - 1].direction) nearest = sights[i].range;
    hidden += sights[i].range > behind * nearest ? 1 : 0;
  }
  return static_cast<double>(hidden) / static_cast<double>(std::max<std::size_t>(1, sights.size()));
}

/// Whether a cloud lies so far above its origin, for its size, that its z are no depths and no
/// sensor stands there: heights above the sea.
bool isHigh(const PointsView& points, const Indices* indices) {
  constexpr double kAbove = 10.0;   // metres
  constexpr double kExtents = 1.5;  // a view across of less than 37 degrees: no camera of a robot
  const std::size_t n = detail::countOf(points, indices);
  std::vector<float> values[3];
  for (std::size_t k = 0; k < n; k += n / kLargestSample + 1) {
    const std::size_t i = detail::at(indices, k);
    if (!isUsable(points, i)) continue;
    for (int axis = 0; axis < 3; ++axis) values[axis].push_back(points[i][axis]);
  }
  if (values[0].empty()) return false;
  Vector3 low, high;
  boundsOf(values, low, high);
  return low.z() > kAbove && low.z() > kExtents * (high - low).norm();
}

PLANAR_MAPPING_MULTIVERSION
void markUsable(const float* points, std::size_t stride, std::size_t n, std::uint8_t* usable) {
  for (std::size_t i = 0; i < n; ++i) {
    const float* p = points + stride * i;
    const bool x = __builtin_fabsf(p[0]) <= kFarthest;
    const bool y = __builtin_fabsf(p[1]) <= kFarthest;
    const bool z = __builtin_fabsf(p[2]) <= kFarthest;
    const bool away = (p[0] != 0.0F) | (p[1] != 0.0F) | (p[2] != 0.0F);
    usable[i] = x & y & z & away ? 1 : 0;
  }
}

}  // namespace

bool isCameraView(const PointsView& points, const Indices* indices) {
  constexpr std::size_t kMaxSample = 100000;
  constexpr double kMaxSlope = 2.0;  // 63 degrees; a scan with its floor at z = 0 goes beyond
  constexpr double kMinFraction = 0.99;
  detail::requireIndices(points, indices);
  const std::size_t n = detail::countOf(points, indices);
  std::size_t usable = 0;
  for (std::size_t k = 0; k < n; ++k) usable += isUsable(points, detail::at(indices, k)) ? 1 : 0;
  const std::size_t step = usable / kMaxSample + 1;
  std::size_t number = 0;
  std::size_t sampled = 0;
  std::size_t in_view = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = detail::at(indices, k);
    if (!isUsable(points, i) || number++ % step != 0) continue;
    const Vector3 p = points.point(i);
    ++sampled;
    in_view += p.z() > 0.0 && p.head<2>().norm() < kMaxSlope * p.z() ? 1 : 0;
  }
  return sampled > 0 &&
         static_cast<double>(in_view) >= kMinFraction * static_cast<double>(sampled) &&
         (points.height > 1 || !isHigh(points, indices));
}

Vector3 verticalOf(const PointsView& points, const Indices* indices, const Pose& T_world_sensor) {
  if (!isCameraView(points, indices)) return Vector3::UnitZ();
  return nearestAxis(T_world_sensor.linear() * -Vector3::UnitY());
}

Vector3 nearestAxis(const Vector3& direction) {
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return direction[axis] < 0.0 ? Vector3(-Vector3::Unit(axis)) : Vector3(Vector3::Unit(axis));
}

bool isMerged(const PointsView& points, const Indices* indices) {
  constexpr double kMaxExtents = 10.0;
  constexpr double kEarth = 1e7;           // metres; farther away nothing is a coordinate
  constexpr std::size_t kMinSights = 100;  // fewer tell nothing
  if (points.height > 1) return false;
  detail::requireIndices(points, indices);
  const std::size_t n = detail::countOf(points, indices);
  std::size_t looked_at = 0;
  Vector3 low = Vector3::Constant(1e300);
  Vector3 high = -low;
  for (std::size_t k = 0; k < n; k += n / kLargestSample + 1) {
    const std::size_t i = detail::at(indices, k);
    if (!isUsable(points, i)) continue;
    ++looked_at;
    low = low.cwiseMin(points.point(i));
    high = high.cwiseMax(points.point(i));
  }
  if (looked_at < kMinSights) return false;
  const double away = Vector3::Zero().cwiseMax(low).cwiseMin(high).norm();
  if (away > kMaxExtents * (high - low).norm() && away < kEarth) return true;
  if (isHigh(points, indices)) return true;
  // docs/dev/automatic_parameters.md: single scans have 0.20 and 0.04 at most.
  return hiddenFraction(points, indices, 1.0, 1.5) > 0.25 ||
         hiddenFraction(points, indices, 0.125, 1.12) > 0.08;
}

CloudScale scaleOf(const PointsView& points, const Indices& indices, const Pose& T_world_sensor) {
  CloudScale scale;
  scale.points = indices.size();
  scale.up = Vector3::UnitZ();
  if (indices.empty()) return scale;
  const std::size_t step = indices.size() / kLargestSample + 1;
  std::vector<Vector3> sample;
  std::vector<float> axis_values[3];
  std::vector<float> ranges;
  for (std::size_t i = 0; i < indices.size(); i += step) {
    const float* p = points[static_cast<std::size_t>(indices[i])];
    sample.emplace_back(p[0], p[1], p[2]);
    for (int axis = 0; axis < 3; ++axis) axis_values[axis].push_back(p[axis]);
    ranges.push_back(static_cast<float>(sample.back().norm()));
  }
  Vector3 low, high;
  boundsOf(axis_values, low, high);
  const Vector3 size = high - low;
  scale.extent = size.norm();
  scale.max_range = quantile(ranges, 1.0 - kOutlierFraction);
  const Spacing spacing = spacingOf(sample, low, size.maxCoeff(), indices.size());
  scale.spacing = spacing.median;
  scale.noise = noiseOf(sample, low, spacing.mean * std::sqrt(static_cast<double>(step)));
  scale.optical = isCameraView(points, &indices);
  scale.up = verticalOf(points, &indices, T_world_sensor);
  return scale;
}

double automaticResolution(const CloudScale& scale) {
  constexpr double kExtentFraction = 0.01;
  constexpr double kLargest = 0.2;  // metres; what a robot of usual size can plan with
  constexpr double kSpacings = 3.0;
  constexpr double kNoises = 4.0;       // half the resolution, d_T, is two standard deviations
  constexpr double kSinglePoint = 0.1;  // without any extent there is nothing to go by
  if (scale.resolution) return *scale.resolution;
  const double wanted = std::max({std::min(kExtentFraction * scale.extent, kLargest),
                                  kSpacings * scale.spacing, kNoises * scale.noise});
  if (!(wanted > 0.0)) return kSinglePoint;
  const int exponent = static_cast<int>(std::floor(std::log10(wanted)));
  double best = 0.0;
  for (const char* digits : {"1e", "2e", "5e", "10e"}) {
    // From text, so that 0.02 is the very 0.02 that a person would write.
    const double candidate = std::stod(digits + std::to_string(exponent));
    const bool nearer = std::abs(std::log(wanted / candidate)) < std::abs(std::log(wanted / best));
    if (best == 0.0 || nearer) best = candidate;
  }
  return best;
}

Indices usablePoints(const PointsView& points) {
  constexpr std::size_t kBlock = 1024;
  std::uint8_t usable[kBlock];
  int kept[kBlock + 1];
  Indices indices;
  indices.reserve(points.size);
  for (std::size_t first = 0; first < points.size; first += kBlock) {
    const std::size_t n = std::min(kBlock, points.size - first);
    markUsable(points[first], points.stride, n, usable);
    indices.insert(indices.end(), kept,
                   detail::listMarked(usable, n, static_cast<int>(first), kept));
  }
  return indices;
}

void requireMetres(const PointsView& points, const Indices* indices, double max_spacing,
                   const char* parameters) {
  constexpr std::size_t kSample = 256;
  constexpr double kRanges = 30.0;
  const double near = kRanges * max_spacing;
  const std::size_t count = detail::countOf(points, indices);
  // Nearly all clouds end here.
  std::size_t far = 0;
  std::size_t finite = 0;
  for (std::size_t i = 0; i < count; i += 1 + count / kSample) {
    const std::size_t index = detail::at(indices, i);
    if (index >= points.size || !points.isMeasured(index)) continue;
    ++finite;
    if (points.point(index).norm() > near) ++far;
  }
  const auto isMost = [](std::size_t part, std::size_t all) {
    return static_cast<double>(part) >= (1.0 - kOutlierFraction) * static_cast<double>(all);
  };
  if (finite == 0 || !isMost(far, finite)) return;
  Indices usable = usablePoints(points);
  if (indices != nullptr) {
    std::vector<std::uint8_t> is_usable(points.size, 0);
    for (const int i : usable) is_usable[static_cast<std::size_t>(i)] = 1;
    usable.clear();
    for (const int i : *indices) {
      const auto index = static_cast<std::size_t>(i);
      if (index < points.size && is_usable[index] != 0) usable.push_back(i);
    }
  }
  const CloudScale scale = scaleOf(points, usable);
  const auto is_far = [&](int i) {
    return points.point(static_cast<std::size_t>(i)).norm() > near;
  };
  const auto far_points = std::count_if(usable.begin(), usable.end(), is_far);
  if (scale.spacing <= max_spacing ||
      !isMost(static_cast<std::size_t>(far_points), usable.size())) {
    return;
  }
  throw InputError("the points are " + std::to_string(scale.spacing) + " apart and up to " +
                   std::to_string(scale.max_range) +
                   " from the sensor, too much for metres: scale a cloud in millimetres by 0.001, "
                   "or set " +
                   parameters + " to suit its unit");
}

}  // namespace planar_mapping
