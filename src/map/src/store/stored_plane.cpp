// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/stored_plane.h"

#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {
namespace {

constexpr double kPi = 3.14159265358979323846;

std::int64_t rounded(double value, double unit, std::int64_t limit) {
  const double steps = std::round(value / unit);
  if (!(std::abs(steps) < static_cast<double>(limit))) {  // false for NaN
    return steps > 0.0 ? limit : steps < 0.0 ? -limit : 0;
  }
  return static_cast<std::int64_t>(steps);
}

Vector3 normalOf(const StoredPlane& plane) {
  const double a = plane.normal[0] * StoredPlane::kDirection;
  const double b = plane.normal[1] * StoredPlane::kDirection;
  const double c = std::sqrt(std::max(0.0, 1.0 - a * a - b * b));
  const Eigen::Index axis = plane.axis % 3;
  Vector3 n;
  n[axis] = plane.axis < 3 ? c : -c;
  n[(axis + 1) % 3] = a;
  n[(axis + 2) % 3] = b;
  return n.normalized();
}

/// Horizontal for a wall.
Vector3 referenceDirection(const Vector3& n) {
  const Vector3 up = std::abs(n.z()) < 0.75 ? Vector3::UnitZ() : Vector3::UnitX();
  return up.cross(n).normalized();
}

/// Covariance of the points along u and v.
Eigen::Matrix2d inPlane(const StoredPlane& plane) {
  const double uu = plane.variance[0].value();
  const double vv = plane.variance[1].value();
  const double uv = plane.correlation * std::sqrt(uu * vv) / StoredPlane::kCorrelation;
  Eigen::Matrix2d c;
  c << uu, uv, uv, vv;
  return c;
}

}  // namespace

RoundedNumber RoundedNumber::from(double value, int bits) {
  if (!(value > 0.0)) return {};
  int exponent = 0;
  const double part = std::frexp(value, &exponent);
  auto mantissa = static_cast<int>(std::lround(std::ldexp(part, bits)));
  exponent -= bits;
  if (mantissa == 1 << bits) {
    mantissa /= 2;
    ++exponent;
  }
  if (exponent < -kLargestExponent) return {};
  return {static_cast<std::uint16_t>(mantissa),
          static_cast<std::int16_t>(std::min(exponent, kLargestExponent - 1))};
}

double RoundedNumber::value() const {
  return std::ldexp(static_cast<double>(mantissa), exponent);
}

StoredPlane StoredPlane::from(const PlaneFrame& wanted, const PlaneMoments& moments) {
  StoredPlane stored;
  Eigen::Index axis = 0;
  wanted.n.cwiseAbs().maxCoeff(&axis);
  stored.axis = static_cast<std::uint8_t>(wanted.n[axis] < 0.0 ? axis + 3 : axis);
  for (Eigen::Index i = 0; i < 2; ++i) {
    stored.normal[static_cast<std::size_t>(i)] =
        static_cast<std::int32_t>(rounded(wanted.n[(axis + 1 + i) % 3], kDirection, 1 << 15));
  }
  const Vector3 n = normalOf(stored);
  const Vector3 along = referenceDirection(n);
  const double turn = std::atan2(n.cross(along).dot(wanted.u), along.dot(wanted.u));
  stored.turn = static_cast<std::int32_t>(rounded(turn, kPi / kHalfTurn, kHalfTurn));
  if (stored.turn == -kHalfTurn) stored.turn = kHalfTurn;
  const PlaneFrame axes = stored.frame();  // of the world's origin: the coordinates are 0 yet
  const Vector3 origin = axes.toPlane(wanted.origin);
  for (Eigen::Index i = 0; i < 3; ++i) {
    stored.origin[static_cast<std::size_t>(i)] = rounded(origin[i], kLength, kLargest);
  }

  stored.weight = RoundedNumber::from(moments.weight(), kWeightBits);
  if (!(moments.weight() > 0.0)) return stored;
  const PlaneFrame frame = stored.frame();
  const Vector3 mean = frame.toPlane(moments.mean());
  for (Eigen::Index i = 0; i < 3; ++i) {
    stored.mean[static_cast<std::size_t>(i)] = rounded(mean[i], i < 2 ? kPlace : kLength, kLargest);
  }
  Matrix3 to_plane;
  to_plane << frame.u, frame.v, frame.n;
  const Matrix3 c = to_plane.transpose() * (moments.scatter() / moments.weight()) * to_plane;
  stored.variance = {RoundedNumber::from(c(0, 0), kVarianceBits),
                     RoundedNumber::from(c(1, 1), kVarianceBits)};
  const double spread = std::sqrt(stored.variance[0].value() * stored.variance[1].value());
  if (spread > 0.0) {
    stored.correlation = static_cast<std::int32_t>(
        rounded(0.5 * (c(0, 1) + c(1, 0)) / spread, 1.0 / kCorrelation, kCorrelation));
  }
  const Eigen::Matrix2d plane = inPlane(stored);
  const Eigen::Vector2d tilted(0.5 * (c(0, 2) + c(2, 0)), 0.5 * (c(1, 2) + c(2, 1)));
  const double determinant = plane.determinant();
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  if (determinant > 1e-9 * spread * spread) {
    slope << (plane(1, 1) * tilted[0] - plane(0, 1) * tilted[1]) / determinant,
        (plane(0, 0) * tilted[1] - plane(0, 1) * tilted[0]) / determinant;
  }
  for (Eigen::Index i = 0; i < 2; ++i) {
    std::int32_t& stored_slope = stored.slope[static_cast<std::size_t>(i)];
    stored_slope = static_cast<std::int32_t>(rounded(slope[i], kDirection, kLargestSlope));
    slope[i] = stored_slope * kDirection;
  }
  // Less than rounding leaves of the sums is nothing.
  const double residual = c(2, 2) - slope.dot(plane * slope);
  const bool is_flat = residual < 1e-12 * (c(0, 0) + c(1, 1));
  stored.residual = RoundedNumber::from(is_flat ? 0.0 : residual, kVarianceBits);
  return stored;
}

PlaneFrame StoredPlane::frame() const {
  PlaneFrame frame;
  frame.n = normalOf(*this);
  const Vector3 along = referenceDirection(frame.n);
  // Walls are mostly not turned at all: then nothing is rounded.
  if (turn == 0 || turn == kHalfTurn) {
    frame.u = turn == 0 ? along : Vector3(-along);
  } else {
    const double angle = turn * (kPi / kHalfTurn);
    frame.u = (std::cos(angle) * along + std::sin(angle) * frame.n.cross(along)).normalized();
  }
  frame.v = frame.n.cross(frame.u);
  frame.origin = static_cast<double>(origin[0]) * kLength * frame.u +
                 static_cast<double>(origin[1]) * kLength * frame.v +
                 static_cast<double>(origin[2]) * kLength * frame.n;
  return frame;
}

PlaneFit StoredPlane::fit() const {
  PlaneFit fit;
  fit.frame = frame();
  fit.plane = planeOf(fit.frame);
  fit.moments = moments(fit.frame);
  return fit;
}

PlaneMoments StoredPlane::moments(const PlaneFrame& frame) const {
  const Eigen::Matrix2d plane = inPlane(*this);
  const Eigen::Vector2d s(slope[0] * kDirection, slope[1] * kDirection);
  const Eigen::Vector2d tilted = plane * s;
  Matrix3 c;
  c << plane(0, 0), plane(0, 1), tilted[0], plane(0, 1), plane(1, 1), tilted[1], tilted[0],
      tilted[1], residual.value() + s.dot(tilted);
  Matrix3 to_plane;
  to_plane << frame.u, frame.v, frame.n;
  Matrix3 scatter = weight.value() * (to_plane * c * to_plane.transpose());
  scatter = (0.5 * (scatter + scatter.transpose())).eval();
  const Vector3 at =
      frame.fromPlane({static_cast<double>(mean[0]) * kPlace, static_cast<double>(mean[1]) * kPlace,
                       static_cast<double>(mean[2]) * kLength});
  return PlaneMoments::fromSums(weight.value(), Vector3::Zero(), scatter, at);
}

}  // namespace planar_mapping::detail
