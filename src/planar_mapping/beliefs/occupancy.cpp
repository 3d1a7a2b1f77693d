// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/beliefs/occupancy.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/point_indices.h"
#include "planar_mapping/geometry/angles.h"

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
  detail::makeDistinct(sorted);
  for (std::int32_t& group : numbers) {
    if (group < 0) continue;
    const auto place = std::lower_bound(sorted.begin(), sorted.end(), group);
    group = static_cast<std::int32_t>(place - sorted.begin());
  }
  return numbers;
}

template <int N>
double relativeDensity(const Eigen::Matrix<double, N, 1>& error,
                       const Eigen::Matrix<double, N, N>& covariance) {
  if (!error.allFinite()) throw ParameterError("motion error", error.sum(), "finite");
  if (!covariance.allFinite())
    throw ParameterError("motion covariance", covariance.sum(), "finite");
  const Eigen::Matrix<double, N, N> symmetric = 0.5 * (covariance + covariance.transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(symmetric);
  const auto& variance = solver.eigenvalues();
  const double largest = variance.cwiseAbs().maxCoeff();
  const double rounding = 1e-12 * largest;
  // Sums and differences of many covariances leave rounding errors behind.
  if (variance[0] < -1e-9 * largest) throw ParameterError("motion covariance", variance[0], ">= 0");
  const Eigen::Matrix<double, N, 1> along = solver.eigenvectors().transpose() * error;
  double exponent = 0.0;
  for (int i = 0; i < N; ++i) {
    if (variance[i] > rounding) {
      exponent += along[i] * along[i] / variance[i];
    } else if (std::abs(along[i]) > 1e-9 * std::max(1.0, error.norm())) {
      return 0.0;
    }
  }
  return std::exp(-0.5 * exponent);
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
    range[k] = points.isMeasured(i) ? points.point(i).norm() : -1.0;
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

double motionFactor(const Vector3& error, const Matrix3& covariance) {
  return relativeDensity<3>(error, covariance);
}

double motionFactor(const Vector6& error, const Matrix6& covariance) {
  return relativeDensity<6>(error, covariance);
}

double poseMotionFactor(const Pose& measured, const Pose& predicted, const Matrix6& covariance) {
  const Eigen::AngleAxisd turn(Matrix3(measured.linear() * predicted.linear().transpose()));
  Vector6 error;
  error << measured.translation() - predicted.translation(), turn.angle() * turn.axis();
  return motionFactor(error, covariance);
}

Matrix3 measurementCovariance(const Vector3& point, const OccupancyParams& params) {
  const double range = point.norm();
  if (!(range > 0.0)) return Matrix3::Zero();
  const double depth = depthOf(point, params.optical_axis);
  const double along = rangeError(range, depth, params.noise);
  const double across = range / params.noise.focal_length * params.noise.disparity_error;
  const Vector3 ray = point / range;
  const Matrix3 along_ray = ray * ray.transpose();
  return along * along * along_ray + across * across * (Matrix3::Identity() - along_ray);
}

double featureMotionFactor(const Vector3& now, const Vector3& before, const Pose& T_now_before,
                           const Matrix6& motion_covariance, const OccupancyParams& params) {
  const Vector3 predicted = T_now_before * before;
  const Matrix3 R = T_now_before.linear();
  // A turn dr about the sensor moves the point by dr x p = -[p]x dr.
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << Matrix3::Identity(), -crossMatrix(predicted);
  const Matrix3 covariance = jacobian * motion_covariance * jacobian.transpose() +
                             measurementCovariance(now, params) +
                             R * measurementCovariance(before, params) * R.transpose();
  return motionFactor(Vector3(now - predicted), covariance);
}

void KlUpdateParams::validate() const {
  requirePositive("eta2", eta2);
  requireInRange("eta2", eta2, 0.0, 1.0);
  requirePositive("eta3", eta3);
  requireInRange("eta3", eta3, 0.0, 1.0);
  requireInRange("bias", bias, 0.0, std::numeric_limits<double>::max());
  requirePositive("clamp", clamp);
  if (!(clamp < 0.5)) throw ParameterError("clamp", clamp, "(0, 0.5)");
}

double observedBelief(double probability, double motion_factor, const KlUpdateParams& params) {
  requireInRange("probability", probability, 0.0, 1.0);
  requireInRange("motion_factor", motion_factor, 0.0, 1.0);
  return params.eta2 * probability * motion_factor;
}

double klDivergence(double before, double observed, const KlUpdateParams& params) {
  requireInRange("before", before, 0.0, 1.0);
  requireInRange("observed", observed, 0.0, 1.0);
  const double p = std::clamp(before, params.clamp, 1.0 - params.clamp);
  const double q = std::clamp(observed, params.clamp, 1.0 - params.clamp);
  return p * std::log(p / q);
}

double updatedBelief(double before, double observed, const KlUpdateParams& params) {
  const double divergence = std::abs(klDivergence(before, observed, params));
  const bool both_weak = before <= 0.5 && observed <= 0.5;
  return params.eta3 * std::exp(-(divergence + (both_weak ? params.bias : 0.0)));
}

}  // namespace planar_mapping
