// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/occupancy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/point_indices.h"
#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

constexpr double kMax = std::numeric_limits<double>::max();

// dr = (rbar / z) * dz with dz = z^2 / (B f) * dd, written so that z = 0 is no special case.
double rangeErrorOf(double mean_range, double depth, const StereoNoise& noise) {
  return mean_range * (depth / (noise.baseline * noise.focal_length)) * noise.disparity_error;
}

double probabilityOf(double range, double mean_range, double range_error, double eta1) {
  const double deviation = range - mean_range;
  if (!(range_error > 0.0)) return deviation == 0.0 ? eta1 : 0.0;
  const double normalized = deviation / range_error;
  return eta1 * std::exp(-0.5 * normalized * normalized);
}

// Groups as 0 .. k - 1, so that sums are plain arrays; -1 stays for "a group of its own".
std::vector<std::int32_t> denseNumbers(const std::vector<std::int32_t>& groups) {
  std::vector<std::int32_t> numbers(groups);
  for (std::int32_t& group : numbers) group = std::max(group, -1);
  const auto largest = std::max_element(numbers.begin(), numbers.end());
  if (largest == numbers.end() ||
      static_cast<std::size_t>(std::int64_t(*largest) + 1) <= 2 * numbers.size()) {
    return numbers;
  }
  std::vector<std::int32_t> sorted(numbers);
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  for (std::int32_t& group : numbers) {
    if (group < 0) continue;
    const auto place = std::lower_bound(sorted.begin(), sorted.end(), group);
    group = static_cast<std::int32_t>(place - sorted.begin());
  }
  return numbers;
}

}  // namespace

void OccupancyParams::validate() const {
  noise.validate();
  requirePositive("eta1", eta1);
  requireInRange("eta1", eta1, 0.0, 1.0);
  requireInRange("single_feature_probability", single_feature_probability, 0.0, 1.0);
  requireInRange("min_range_error", min_range_error, 0.0, kMax, "m");
  for (int i = 0; i < 3; ++i) requireInRange("optical_axis", optical_axis[i], -1e9, 1e9);
}

double depthOf(const Vector3& point, const Vector3& optical_axis) {
  const double length = optical_axis.norm();
  return length > 0.0 ? std::abs(point.dot(optical_axis)) / length : point.norm();
}

double rangeError(double mean_range, double depth, const StereoNoise& noise) {
  requireInRange("mean_range", mean_range, 0.0, kMax, "m");
  requireInRange("depth", depth, 0.0, kMax, "m");
  return rangeErrorOf(mean_range, depth, noise);
}

double featureProbability(double range, double mean_range, double range_error, double eta1) {
  requireInRange("range", range, 0.0, kMax, "m");
  requireInRange("mean_range", mean_range, 0.0, kMax, "m");
  requireInRange("range_error", range_error, 0.0, kMax, "m");
  requireInRange("eta1", eta1, 0.0, 1.0);
  return probabilityOf(range, mean_range, range_error, eta1);
}

std::vector<float> featureProbabilities(const PointsView& points, const Indices* indices,
                                        const std::vector<std::int32_t>& groups,
                                        const OccupancyParams& params) {
  params.validate();
  detail::requireIndices(points, indices);
  const std::size_t n = detail::countOf(points, indices);
  if (groups.size() != n) {
    throw InputError("groups: " + std::to_string(groups.size()) + " values for " +
                     std::to_string(n) + " features");
  }

  const std::vector<std::int32_t> slot_of = denseNumbers(groups);
  const std::size_t slots =
      n == 0 ? 0 : static_cast<std::size_t>(*std::max_element(slot_of.begin(), slot_of.end()) + 1);
  std::vector<double> range_sum(slots, 0.0);
  std::vector<std::int32_t> count(slots, 0);
  std::vector<double> range(n);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = detail::at(indices, k);
    range[k] = points.isFinite(i) ? points.point(i).norm() : -1.0;
    if (range[k] < 0.0 || slot_of[k] < 0) continue;
    range_sum[slot_of[k]] += range[k];
    ++count[slot_of[k]];
  }

  const double axis = params.optical_axis.norm();
  std::vector<float> result(n, 0.0f);
  for (std::size_t k = 0; k < n; ++k) {
    if (range[k] < 0.0) continue;
    const std::int32_t slot = slot_of[k];
    if (slot < 0 || count[slot] == 1) {
      result[k] = static_cast<float>(params.single_feature_probability);
      continue;
    }
    const Vector3 point = points.point(detail::at(indices, k));
    const double mean = range_sum[slot] / count[slot];
    const double depth = axis > 0.0 ? std::abs(point.dot(params.optical_axis)) / axis : range[k];
    const double error = std::max(rangeErrorOf(mean, depth, params.noise), params.min_range_error);
    result[k] = static_cast<float>(probabilityOf(range[k], mean, error, params.eta1));
  }
  return result;
}

}  // namespace planar_mapping
