// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/geometry/cloud_scale.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/point_indices.h"
#include "planar_mapping/geometry/cloud_sample.h"
#include "planar_mapping/geometry/point_sums.h"

namespace planar_mapping {
namespace {

using detail::boundsOf;
using detail::gapOfFaces;
using detail::kLargestSample;
using detail::kOutlierFraction;
using detail::PointSums;
using detail::quantile;

constexpr int kCellsAlongAxis = 64;  // of the grid that measures the surface

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

/// RMS distance of points from their plane, or, where they are both faces of a wall, from the plane
/// of their face. \param offsets  from a place near them
double roughnessOf(const std::vector<Vector3>& offsets) {
  constexpr int kRounds = 3;  // few points tilt the first plane
  PointSums all;
  for (const Vector3& p : offsets) all.add(p.x(), p.y(), p.z());
  const PlaneMoments moments = all.moments(Vector3::Zero());
  const PlaneMoments::Fit fit = moments.fit();
  Vector3 normal = fit.plane.normal;
  for (int round = 0; round < kRounds && fit.valid; ++round) {
    std::array<PointSums, 2> half;
    for (const Vector3& p : offsets) {
      half[normal.dot(p - moments.mean()) > 0.0 ? 1 : 0].add(p.x(), p.y(), p.z());
    }
    const PlaneMoments a = half[0].moments(Vector3::Zero()), b = half[1].moments(Vector3::Zero());
    const PlaneMoments::Fit fit_a = a.fit();
    if (gapOfFaces(a, b) > 0.0) {
      const double squares =
          a.weight() * std::pow(fit_a.rms, 2) + b.weight() * std::pow(b.fit().rms, 2);
      return std::sqrt(squares / all.n);
    }
    normal = fit_a.plane.normal;
  }
  return fit.rms;
}

/// Median over cells of a side of the roughness of their points. Cells that hold but the fringe of
/// a surface do not count.
std::optional<double> noiseIn(const std::vector<Vector3>& sample, const Vector3& low, double side) {
  constexpr std::ptrdiff_t kMinPoints = 12;  // that tell a plane from its noise
  constexpr double kMinFractionOfMean = 0.25;
  std::vector<std::pair<std::uint64_t, std::size_t>> places;  // cells and points
  places.reserve(sample.size());
  for (std::size_t i = 0; i < sample.size(); ++i) {
    const Vector3 p = (sample[i] - low) / side;
    std::uint64_t cell = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double c = std::floor(std::clamp(p[axis], -1e6, 1e6));
      cell = cell << 21u | (static_cast<std::uint64_t>(c + 1e6) & 0x1FFFFFu);
    }
    places.emplace_back(cell, i);
  }
  std::sort(places.begin(), places.end());
  std::vector<Vector3> offsets;
  std::vector<float> residuals;
  std::vector<double> counts;
  double total = 0.0;
  for (auto first = places.begin(); first != places.end();) {
    auto last = first;
    offsets.clear();
    for (; last != places.end() && last->first == first->first; ++last) {
      offsets.push_back(sample[last->second] - sample[first->second]);
    }
    if (last - first >= kMinPoints) {
      const auto n = static_cast<double>(last - first);
      residuals.push_back(static_cast<float>(roughnessOf(offsets)));
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

}  // namespace

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
  constexpr double kLargest = 0.2;      // metres; what a robot of usual size can plan with
  constexpr double kSpacings = 3.0;     // up to the largest
  constexpr double kFewSpacings = 2.0;  // above it: a floor is to differ from what stands on it
  constexpr double kMetres = 1.0;       // more than points of a robot are apart: millimetres
  constexpr double kNoises = 4.0;       // half the resolution, d_T, is two standard deviations
  constexpr double kSinglePoint = 0.1;  // without any extent there is nothing to go by
  if (scale.resolution) return *scale.resolution;
  const double least = scale.spacing > kMetres ? kSpacings : kFewSpacings;
  const double wanted = std::max(
      {std::min(std::max(kExtentFraction * scale.extent, kSpacings * scale.spacing), kLargest),
       least * scale.spacing, kNoises * scale.noise});
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

double automaticThreshold(const CloudScale& scale) {
  return 0.5 * automaticResolution(scale);
}

int automaticSmallestPlane(const CloudScale& scale) {
  constexpr std::size_t kSmallest = 50;
  constexpr std::size_t kFraction = 300;
  return static_cast<int>(std::max(kSmallest, scale.points / kFraction));
}

Indices usablePoints(const PointsView& points) {
  detail::requireIndices(points, nullptr);
  Indices indices(points.size);
  std::size_t count = 0;
  for (std::size_t i = 0; i < points.size; ++i) {
    if (detail::isUsable(points, i)) indices[count++] = static_cast<int>(i);
  }
  indices.resize(count);
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
  Indices usable;
  if (indices == nullptr) {
    usable = usablePoints(points);
  } else {
    std::copy_if(indices->begin(), indices->end(), std::back_inserter(usable), [&](int i) {
      const auto index = static_cast<std::size_t>(i);
      return index < points.size && detail::isUsable(points, index);
    });
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
  constexpr double kMetres = 0.1;  // more than points of a room are apart
  const std::string found = "the points are " + std::to_string(scale.spacing) +
                            " apart and up to " + std::to_string(scale.max_range) +
                            " from the sensor, too much for ";
  if (scale.spacing < kMetres) throw InputError(found + parameters + ": set a larger value");
  throw InputError(found + "metres: scale a cloud in millimetres by 0.001, or set " + parameters +
                   " to suit its unit");
}

}  // namespace planar_mapping
