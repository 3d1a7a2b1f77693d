// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/registration/surface_registration.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping::detail {
namespace {

constexpr double kUnknownTranslation = 1.0;  // metres, see CloudRegistration
constexpr double kUnknownRotation = 0.5;     // radians
constexpr std::size_t kMinPlanes = 6;
constexpr double kLateralError = 0.01;  // standard deviation of a point across its ray, metres
// If less than kGoodFraction of the planes, by weight, or kGoodEdges of the edges find their place,
// further guesses are tried, turned by kRetryRotation about each axis, until two with
// kConfirmedFraction agree.
constexpr double kRetryRotation = 0.14;  // radians
constexpr double kGoodFraction = 0.75;
constexpr double kGoodEdges = 0.6;
constexpr double kConfirmedFraction = 0.5;
constexpr double kSameRotation = 0.02;  // radians: two searches that ended there agree
// So many times more than errors of normals tell is meant: those of rings all lean alike.
constexpr double kTimesNoise = 2.0;

Matrix6 weakInformation() {
  Vector6 information;
  information << Vector3::Constant(1.0 / (kUnknownTranslation * kUnknownTranslation)),
      Vector3::Constant(1.0 / (kUnknownRotation * kUnknownRotation));
  return Matrix6(information.asDiagonal());
}

/// Without the directions that only the errors of the planes' normals seem to
/// hold: a bare floor does not keep the camera from sliding. \param noise  what
/// such errors would tell
Matrix6 meaningful(const Matrix6& information, const Matrix6& noise) {
  const Eigen::LLT<Matrix6> factor(noise + weakInformation());
  const Matrix6 half = factor.matrixL().solve(information);
  const Eigen::Matrix<double, 6, 6> whitened = factor.matrixL().solve(Matrix6(half.transpose()));
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(whitened);
  Vector6 ratios = solver.eigenvalues();
  for (int i = 0; i < 6; ++i) {
    if (ratios[i] < kTimesNoise) ratios[i] = 0.0;
  }
  const Matrix6 vectors = factor.matrixL() * Matrix6(solver.eigenvectors());
  return vectors * ratios.asDiagonal() * vectors.transpose();
}

/// What a normal that is off by a little seems to tell about the directions
/// along its plane.
void addNoise(const Pose& T_world_sensor, const Surfel& plane, const Surfel& target, double weight,
              RegistrationEquations& sum) {
  const Vector3 n = T_world_sensor.linear().transpose() * target.normal;
  const Vector3 u = n.unitOrthogonal();
  for (const Vector3& along : {u, Vector3(n.cross(u))}) {
    Vector6 jacobian;
    jacobian << along, plane.center.cross(along);
    sum.noise.noalias() +=
        weight * target.normal_error * target.normal_error * jacobian * jacobian.transpose();
  }
}

/// A plane of the cloud at this distance from one of the map. The unknown is
/// the error of T_sensor_world in the sensor's frame: where the map's plane
/// lies as the sensor sees it.
void addPlane(const Pose& T_world_sensor, const Surfel& plane, const Vector3& target_normal,
              double distance, double weight, RegistrationEquations& sum) {
  const Vector3 n = T_world_sensor.linear().transpose() * target_normal;
  Vector6 jacobian;
  jacobian << n, plane.center.cross(n);
  sum.hessian.noalias() += weight * jacobian * jacobian.transpose();
  sum.gradient.noalias() += weight * distance * jacobian;
}

/// An edge may slide along the one in the map, in the two other directions it
/// is held.
template <typename Weight>
void addEdge(const Pose& T_world_sensor, const Surfel& edge, const Surfel& target,
             const Weight& weightOf, RegistrationEquations& sum) {
  const Vector3 off = T_world_sensor * edge.center - target.center;
  const Vector3 across = off - target.normal.dot(off) * target.normal;
  const double variance = kEdgeError * kEdgeError + edge.deviation * edge.deviation +
                          target.deviation * target.deviation;
  const double weight = weightOf(variance, across.squaredNorm());
  const Vector3 side = target.normal.unitOrthogonal();
  for (const Vector3& normal : {side, Vector3(target.normal.cross(side))}) {
    addPlane(T_world_sensor, edge, normal, normal.dot(off), weight, sum);
  }
}

/// Of the distance between a plane of the cloud and one of the map. What is seen edge-on is off by
/// the place of its points across the ray.
double varianceOf(const Surfel& plane, const Surfel& target) {
  const double slant = plane.center.normalized().dot(plane.normal);
  const double squared = slant * slant;
  return squared * plane.error * plane.error + (1.0 - squared) * kLateralError * kLateralError +
         target.deviation * target.deviation;
}

bool improve(const RegistrationEquations& sum, Pose& pose, double* step_length) {
  if (sum.matched < kMinPlanes) return false;
  // Directions the planes say nothing about stay as they were.
  const Vector6 step = Eigen::LDLT<Matrix6>(sum.hessian + weakInformation()).solve(sum.gradient);
  if (!step.allFinite()) return false;
  pose = motionStep(step) * pose;
  pose.linear() = Eigen::Quaterniond(Matrix3(pose.linear())).normalized().toRotationMatrix();
  if (step_length != nullptr) *step_length = step.norm();
  return true;
}

}  // namespace

RegistrationCandidate SurfaceRegistration::run(const Pose& guess) const {
  RegistrationCandidate best = settle(guess.inverse());
  if (shape_.fine.planes.empty()) return best;
  const auto planes = static_cast<double>(shape_.fine.planes.size());
  // Most planes tell nothing about the turn about their own normal: that first.
  const auto commonest = std::min_element(shape_.fine.weights.begin(), shape_.fine.weights.end()) -
                         shape_.fine.weights.begin();
  const Vector3 normal = shape_.fine.planes[static_cast<std::size_t>(commonest)].normal;
  const Vector3 across = normal.unitOrthogonal();
  const Vector3 axes[3] = {normal, across, normal.cross(across)};
  for (int turn = 0; turn < 6 && !isGood(best); ++turn) {
    Vector6 step = Vector6::Zero();
    step.tail<3>() = (turn % 2 == 0 ? 1.0 : -1.0) * kRetryRotation * axes[turn / 2];
    const RegistrationCandidate other = settle(motionStep(step) * guess.inverse());
    const double fraction = std::min(best.at_end.balanced, other.at_end.balanced) / planes;
    const Vector6 apart = motionDifference(best.T_sensor_world, other.T_sensor_world);
    if (other.at_end.score > best.at_end.score) best = other;
    // From two sides to the same place.
    if (fraction >= kConfirmedFraction && apart.head<3>().norm() < 0.5 * params_.cell &&
        apart.tail<3>().norm() < kSameRotation) {
      break;
    }
  }
  return best;
}

/// Planes say little about slides along them: the edges must fit as well.
bool SurfaceRegistration::isGood(const RegistrationCandidate& candidate) const {
  return candidate.at_end.balanced >=
             kGoodFraction * static_cast<double>(shape_.fine.planes.size()) &&
         static_cast<double>(candidate.at_end.edges) >=
             kGoodEdges * static_cast<double>(shape_.edges.size());
}

CloudRegistration SurfaceRegistration::resultOf(const RegistrationCandidate& candidate) const {
  CloudRegistration result;
  result.planes = shape_.fine.planes.size();
  result.matched = candidate.at_end.matched;
  if (result.matched < kMinPlanes) return result;
  const auto matched = static_cast<double>(result.matched);
  const double ratio = candidate.at_end.squared_error / matched;
  const Matrix6 information =
      meaningful(candidate.at_end.hessian, candidate.at_end.noise) / std::max(1.0, ratio) +
      weakInformation();
  const Matrix6 covariance = Eigen::LDLT<Matrix6>(information).solve(Matrix6::Identity());
  result.covariance = 0.5 * (covariance + covariance.transpose());
  result.rms = std::sqrt(candidate.at_end.squared_distance / matched);
  result.T_world_sensor = candidate.T_sensor_world.inverse();
  const auto planes = static_cast<double>(result.planes);
  result.fraction = candidate.at_end.balanced / planes;
  // Of scans each direction has to fit: all around there is much that fits anywhere, as the floor.
  result.found = matched >= params_.min_fraction * planes &&
                 (!params_.optical_axis.isZero() || result.fraction >= params_.min_fraction);
  return result;
}

RegistrationCandidate SurfaceRegistration::settle(const Pose& guess) const {
  RegistrationCandidate candidate;
  candidate.T_sensor_world = guess;
  if (approach(candidate.T_sensor_world) && refine(candidate.T_sensor_world)) {
    candidate = at(candidate.T_sensor_world);
  }
  return candidate;
}

/// Brings the cloud near: each plane is drawn to the next one in the map that
/// faces the same way, first from afar.
bool SurfaceRegistration::approach(Pose& pose) const {
  constexpr double kShrink = 0.8;
  constexpr double kSoftness = 0.2;  // of the reach: distances below count in full
  constexpr std::size_t kMaxPlanes = 400;
  const double min_cosine = std::cos(kMaxNormalAngle);
  const std::size_t stride = shape_.coarse.planes.size() / kMaxPlanes + 1;
  double reach = params_.reach;
  while (reach > 2.0 * params_.cell) {
    const Pose T_world_sensor = pose.inverse();
    const double soft = kSoftness * reach;
    const auto weightOf = [soft](double variance, double squared) {
      return 1.0 / (variance + soft * soft + squared);
    };
    RegistrationEquations sum;
    for (std::size_t i = 0; i < shape_.coarse.planes.size(); i += stride) {
      const Surfel& plane = shape_.coarse.planes[i];
      const Vector3 q = T_world_sensor * plane.center;
      const Surfel* target =
          map_.coarse_nearby.nearest(q, T_world_sensor.linear() * plane.normal, reach, min_cosine);
      if (target == nullptr) continue;
      const double distance = target->normal.dot(q - target->center);
      const double weight =
          shape_.coarse.weights[i] * weightOf(varianceOf(plane, *target), distance * distance);
      addPlane(T_world_sensor, plane, target->normal, distance, weight, sum);
      ++sum.matched;
    }
    for (const Surfel& edge : shape_.edges) {
      const Surfel* target = map_.edges_nearby.nearest(
          T_world_sensor * edge.center, T_world_sensor.linear() * edge.normal, reach, min_cosine);
      if (target == nullptr) continue;
      addEdge(T_world_sensor, edge, *target, weightOf, sum);
    }
    if (!improve(sum, pose, nullptr)) return false;
    reach *= kShrink;
  }
  return true;
}

bool SurfaceRegistration::refine(Pose& pose) const {
  constexpr double kSettled = 1e-5;
  constexpr int kMaxIterations = 15;
  constexpr double kShrink = 0.7;
  const double reach = params_.cell;
  double tolerance = 0.5 * reach;
  for (int i = 0; i < kMaxIterations; ++i) {
    double step = 0.0;
    if (!improve(equations(pose, tolerance, true), pose, &step)) return false;
    tolerance *= kShrink;
    if (step < kSettled && tolerance < 0.05 * reach) break;
  }
  return true;
}

/// \param tolerance  on top of the noise, lets planes count that are not yet in
/// place \param balanced   each direction counts the same; else by what the
/// planes tell
RegistrationEquations SurfaceRegistration::equations(const Pose& T_sensor_world, double tolerance,
                                                     bool balanced) const {
  constexpr double kSigmas = 2.5;  // beyond, a plane is on something else
  const Pose T_world_sensor = T_sensor_world.inverse();
  const double min_cosine = std::cos(kMaxNormalAngle);
  const auto fadeOf = [](double squared) {
    return std::max(0.0, 1.0 - squared / (kSigmas * kSigmas));
  };
  RegistrationEquations sum;
  for (std::size_t i = 0; i < shape_.fine.planes.size(); ++i) {
    const Surfel& plane = shape_.fine.planes[i];
    const Vector3 q = T_world_sensor * plane.center;
    const Surfel* target = map_.fine.nearest(q, T_world_sensor.linear() * plane.normal, min_cosine);
    if (target == nullptr) continue;
    const double distance = target->normal.dot(q - target->center);
    const double variance = varianceOf(plane, *target) + tolerance * tolerance;
    const double squared = distance * distance / variance;
    const double fade = fadeOf(squared);
    if (fade <= 0.0) continue;
    const double weight = fade * fade / variance;
    addPlane(T_world_sensor, plane, target->normal, distance,
             balanced ? shape_.fine.weights[i] * weight : weight, sum);
    if (!balanced) addNoise(T_world_sensor, plane, *target, weight, sum);
    sum.squared_distance += distance * distance;
    sum.squared_error += squared;
    sum.score += shape_.fine.weights[i] * fade * fade;
    sum.balanced += shape_.fine.weights[i];
    ++sum.matched;
  }
  const auto weightOf = [&](double variance, double squared) {
    const double softened = variance + tolerance * tolerance;
    const double fade = fadeOf(squared / softened);
    sum.score += fade * fade;
    sum.edges += fade > 0.0 ? 1 : 0;
    return fade * fade / softened;
  };
  for (const Surfel& edge : shape_.edges) {
    const Surfel* target = map_.edges.nearest(T_world_sensor * edge.center,
                                              T_world_sensor.linear() * edge.normal, min_cosine);
    if (target == nullptr) continue;
    addEdge(T_world_sensor, edge, *target, weightOf, sum);
  }
  return sum;
}

}  // namespace planar_mapping::detail
