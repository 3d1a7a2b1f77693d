// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/plane_moments.h"

namespace planar_mapping::detail {

/// Weight, sum and outer products of points, as seen from a place near them.
struct PointSums {
  double n = 0;
  std::array<double, 3> sum{};
  std::array<double, 6> outer{};  ///< xx, xy, xz, yy, yz, zz

  /// \param weight negative: takes the point away again
  void add(double x, double y, double z, double weight = 1.0) {
    n += weight;
    sum[0] += weight * x;
    sum[1] += weight * y;
    sum[2] += weight * z;
    outer[0] += weight * x * x;
    outer[1] += weight * x * y;
    outer[2] += weight * x * z;
    outer[3] += weight * y * y;
    outer[4] += weight * y * z;
    outer[5] += weight * z * z;
  }
  /// Adds sums about a place that lies at \p shift as seen from ours.
  void add(const PointSums& other, const Vector3& shift) {
    const auto& s = other.sum;
    const double m = other.n;
    std::size_t k = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = i; j < 3; ++j, ++k) {
        outer[k] += other.outer[k] + s[i] * shift[j] + shift[i] * s[j] + m * shift[i] * shift[j];
      }
    }
    for (std::size_t i = 0; i < 3; ++i) sum[i] += s[i] + m * shift[i];
    n += m;
  }
  /// \param origin the place that the sums are about
  PlaneMoments moments(const Vector3& origin) const {
    Matrix3 squares;
    squares << outer[0], outer[1], outer[2], outer[1], outer[3], outer[4], outer[2], outer[4],
        outer[5];
    return PlaneMoments::fromSums(n, {sum[0], sum[1], sum[2]}, squares, origin);
  }
};

/// Distance between two parallel faces, the points of each given; 0 for the halves of one thick
/// surface, which are 2.7 (Gaussian) to 3.5 (uniform) of their standard deviations apart.
inline double gapOfFaces(const PlaneMoments& a, const PlaneMoments& b) {
  constexpr double kMinDeviations = 6.0;
  const PlaneMoments::Fit fit_a = a.fit(), fit_b = b.fit();
  if (!fit_a.valid || !fit_b.valid) return 0.0;
  const Vector3 apart = b.mean() - a.mean();
  const double gap =
      std::min(std::abs(fit_a.plane.normal.dot(apart)), std::abs(fit_b.plane.normal.dot(apart)));
  return gap >= kMinDeviations * std::max(fit_a.rms, fit_b.rms) ? gap : 0.0;
}

}  // namespace planar_mapping::detail
