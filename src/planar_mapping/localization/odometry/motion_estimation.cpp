// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/odometry/motion_estimation.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/localization/odometry/motion_refinement.h"

namespace planar_mapping {
namespace {

constexpr int kLocalIterations = 4;
constexpr int kFinalIterations = 15;

/// A motion, how well the matches agree with it, and which.
struct Hypothesis {
  Pose motion = Pose::Identity();
  double cost = std::numeric_limits<double>::infinity();
  std::vector<std::uint8_t> is_inlier;
  std::size_t inliers = 0;
};

using Sample = std::array<std::size_t, 3>;

class MotionSearch {
 public:
  MotionSearch(const std::vector<FeatureMatch>& matches, const FeatureCamera& camera,
               const MotionParams& params, Random& random)
      : matches_(matches), camera_(camera), params_(params), random_(random) {
    now_.reserve(matches.size());
    now_covariance_.reserve(matches.size());
    for (const FeatureMatch& match : matches) {
      now_.push_back(backProject(camera, match.now));
      now_covariance_.push_back(
          positionCovariance(camera, match.now, detail::varianceOf(match, camera)));
    }
  }

  void run(const Pose* guess) {
    if (guess != nullptr) consider(*guess);
    for (std::size_t tried = 0; tried < neededIterations(); ++tried) {
      Sample sample;
      Pose motion;
      if (drawSample(sample) && isConsistent(sample) && motionOf(sample, motion)) consider(motion);
    }
  }

  const Hypothesis& best() const { return best_; }

  /// Which matches agree with a motion; gives up where it costs more than \p limit.
  Hypothesis evaluate(const Pose& motion, double limit) const {
    const double threshold = params_.inlier_sigmas * params_.inlier_sigmas;
    Hypothesis hypothesis;
    hypothesis.motion = motion;
    hypothesis.cost = 0.0;
    hypothesis.is_inlier.assign(matches_.size(), 0);
    for (std::size_t i = 0; i < matches_.size(); ++i) {
      const double error = detail::squaredError(matches_[i], camera_, motion) / threshold;
      if (error <= 1.0) {
        hypothesis.is_inlier[i] = 1;
        ++hypothesis.inliers;
        hypothesis.cost += error;
      } else {
        hypothesis.cost += 1.0;
      }
      if (hypothesis.cost >= limit) {
        hypothesis.cost = std::numeric_limits<double>::infinity();
        return hypothesis;
      }
    }
    return hypothesis;
  }

 private:
  /// Keeps the motion, refined over the matches that agree with it, if it is the best so far.
  void consider(const Pose& motion) {
    Hypothesis hypothesis = evaluate(motion, best_.cost);
    if (hypothesis.cost >= best_.cost || hypothesis.inliers < 3) return;
    best_ = hypothesis;
    detail::Refinement unused;
    Pose refined = motion;
    if (!detail::refineMotion(matches_, hypothesis.is_inlier, camera_, kLocalIterations, refined,
                              unused)) {
      return;
    }
    Hypothesis better = evaluate(refined, best_.cost);
    if (better.cost < best_.cost) best_ = std::move(better);
  }

  std::size_t neededIterations() const {
    constexpr double kConfidence = 0.9999;  // of having tried one clean minimal set
    constexpr std::size_t kMinIterations = 20;
    const auto most = static_cast<std::size_t>(params_.max_iterations);
    const auto least = std::min(most, kMinIterations);
    const double fraction =
        static_cast<double>(best_.inliers) / static_cast<double>(matches_.size());
    const double clean = fraction * fraction * fraction;
    if (!(clean > 0.0)) return most;
    if (clean >= 1.0) return least;
    const double needed = std::log1p(-kConfidence) / std::log1p(-clean);
    return std::clamp(static_cast<std::size_t>(std::min(needed, 1e9)) + 1, least, most);
  }

  bool drawSample(Sample& sample) {
    const auto count = static_cast<std::uint32_t>(matches_.size());
    for (std::size_t& index : sample) index = random_.below(count);
    return sample[0] != sample[1] && sample[0] != sample[2] && sample[1] != sample[2];
  }

  /// A rigid motion keeps distances; a triangle without height does not fix it.
  bool isConsistent(const Sample& sample) const {
    // Flatter ones leave the turn about the long side open.
    constexpr double kMinTriangleSine = 0.05;
    double longest = 0.0;
    for (int side = 0; side < 3; ++side) {
      const std::size_t i = sample[side];
      const std::size_t j = sample[(side + 1) % 3];
      const Vector3 before = matches_[j].before - matches_[i].before;
      const Vector3 now = now_[j] - now_[i];
      const double length_before = before.norm();
      const double length_now = now.norm();
      if (!(length_before > 0.0) || !(length_now > 0.0)) return false;
      const Vector3 u = before / length_before;
      const Vector3 v = now / length_now;
      const double variance = u.dot((matches_[i].covariance + matches_[j].covariance) * u) +
                              v.dot((now_covariance_[i] + now_covariance_[j]) * v);
      const double allowed = params_.inlier_sigmas * std::sqrt(variance);
      if (!(std::abs(length_before - length_now) <= allowed)) return false;
      longest = std::max(longest, length_before);
    }
    const Vector3& p = matches_[sample[0]].before;
    const double area =
        (matches_[sample[1]].before - p).cross(matches_[sample[2]].before - p).norm();
    return area > kMinTriangleSine * longest * longest;
  }

  bool motionOf(const Sample& sample, Pose& motion) const {
    std::vector<Vector3> before, now;
    std::vector<FeatureMatch> three;
    for (const std::size_t i : sample) {
      before.push_back(matches_[i].before);
      now.push_back(now_[i]);
      three.push_back(matches_[i]);
    }
    if (!rigidMotion(before, now, motion)) return false;
    // Rays are known better than depths.
    detail::Refinement unused;
    detail::refineMotion(three, {1, 1, 1}, camera_, 2, motion, unused);
    return true;
  }

  const std::vector<FeatureMatch>& matches_;
  const FeatureCamera& camera_;
  const MotionParams& params_;
  Random& random_;
  std::vector<Vector3> now_;
  std::vector<Matrix3> now_covariance_;
  Hypothesis best_;
};

bool isUsable(const FeatureMatch& match) {
  const FeatureSighting& now = match.now;
  return match.before.allFinite() && match.covariance.allFinite() && std::isfinite(now.column) &&
         std::isfinite(now.row) && std::isfinite(now.inverse_depth) && now.inverse_depth > 0.0 &&
         now.inverse_depth < 1.0 / detail::kNearestDepth;
}

/// Refits to the inliers until they stay the same.
bool refit(const MotionSearch& search, const std::vector<FeatureMatch>& matches,
           const FeatureCamera& camera, Hypothesis& hypothesis, detail::Refinement& refinement) {
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    Pose motion = hypothesis.motion;
    if (!detail::refineMotion(matches, hypothesis.is_inlier, camera, kFinalIterations, motion,
                              refinement)) {
      return false;
    }
    Hypothesis next = search.evaluate(motion, std::numeric_limits<double>::infinity());
    const bool settled = next.is_inlier == hypothesis.is_inlier;
    hypothesis = std::move(next);
    if (settled) break;
  }
  return hypothesis.inliers >= 3;
}

}  // namespace

bool MotionParams::isCertain(const Matrix6& covariance) const {
  const auto largest = [](const Matrix3& block) {
    return std::sqrt(
        std::max(0.0, Eigen::SelfAdjointEigenSolver<Matrix3>(block).eigenvalues().maxCoeff()));
  };
  return covariance.allFinite() &&
         largest(covariance.topLeftCorner<3, 3>()) <= max_translation_error &&
         largest(covariance.bottomRightCorner<3, 3>()) <= max_rotation_error;
}

void MotionParams::validate() const {
  constexpr double kLargest = std::numeric_limits<double>::max();
  requirePositive("inlier_sigmas", inlier_sigmas);
  requireInRange("min_matches", min_matches, 3, kLargest);
  requireInRange("min_inliers", min_inliers, 3, kLargest);
  requireInRange("max_iterations", max_iterations, 1, kLargest);
  requirePositive("max_translation_error", max_translation_error, "m");
  requirePositive("max_rotation_error", max_rotation_error, "rad");
}

MotionEstimate estimateMotion(const std::vector<FeatureMatch>& matches, const FeatureCamera& camera,
                              const MotionParams& params, Random& random, const Pose* guess) {
  params.validate();
  camera.validate();
  MotionEstimate result;
  result.is_inlier.assign(matches.size(), 0);
  std::vector<FeatureMatch> usable;
  std::vector<std::size_t> origin;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!isUsable(matches[i])) continue;
    usable.push_back(matches[i]);
    origin.push_back(i);
  }
  if (usable.size() < static_cast<std::size_t>(params.min_matches)) return result;

  MotionSearch search(usable, camera, params, random);
  search.run(guess);
  Hypothesis best = search.best();
  result.status = MotionStatus::TooFewInliers;
  const auto enough = [&](std::size_t inliers) {
    return inliers >= static_cast<std::size_t>(params.min_inliers);
  };
  result.inliers = best.inliers;
  if (!enough(best.inliers)) return result;
  detail::Refinement refinement;
  const bool refined = refit(search, usable, camera, best, refinement);
  result.inliers = best.inliers;
  if (!refined) {
    result.status = MotionStatus::Uncertain;
    return result;
  }
  if (!enough(best.inliers)) return result;

  const double freedom = 3.0 * static_cast<double>(best.inliers) - 6.0;
  const Eigen::LDLT<Matrix6> solver(refinement.information);
  const double scale = std::max(1.0, refinement.squared_error / freedom);
  const Matrix6 covariance = scale * solver.solve(Matrix6::Identity());
  if (!solver.isPositive() || !params.isCertain(covariance)) {
    result.status = MotionStatus::Uncertain;
    return result;
  }
  result.status = MotionStatus::Found;
  result.T_now_before = best.motion;
  result.covariance = 0.5 * (covariance + covariance.transpose());
  for (std::size_t i = 0; i < origin.size(); ++i) result.is_inlier[origin[i]] = best.is_inlier[i];
  return result;
}

bool rigidMotion(const std::vector<Vector3>& p, const std::vector<Vector3>& q, Pose& motion) {
  if (p.size() != q.size() || p.size() < 3) return false;
  Vector3 p_mean = Vector3::Zero();
  Vector3 q_mean = Vector3::Zero();
  for (std::size_t i = 0; i < p.size(); ++i) {
    p_mean += p[i];
    q_mean += q[i];
  }
  p_mean /= static_cast<double>(p.size());
  q_mean /= static_cast<double>(p.size());
  Matrix3 correlation = Matrix3::Zero();
  double p_spread = 0.0;
  double q_spread = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    correlation += (q[i] - q_mean) * (p[i] - p_mean).transpose();
    p_spread += (p[i] - p_mean).squaredNorm();
    q_spread += (q[i] - q_mean).squaredNorm();
  }
  const double spread = std::sqrt(p_spread) * std::sqrt(q_spread);
  if (!std::isfinite(spread) || !(spread > 0.0) || !correlation.allFinite()) return false;
  const Eigen::JacobiSVD<Matrix3> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  // Two directions must be known; the third follows from the handedness.
  if (!(svd.singularValues()[1] > 1e-10 * spread)) return false;
  Vector3 handedness = Vector3::Ones();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0) handedness.z() = -1.0;
  motion = Pose::Identity();
  motion.linear() = svd.matrixU() * handedness.asDiagonal() * svd.matrixV().transpose();
  motion.translation() = q_mean - motion.linear() * p_mean;
  return true;
}

Pose motionStep(const Vector6& step) {
  Pose motion = Pose::Identity();
  const Vector3 turn = step.tail<3>();
  const double angle = turn.norm();
  if (angle > 0.0) motion.linear() = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  motion.translation() = step.head<3>();
  return motion;
}

Vector6 motionDifference(const Pose& from, const Pose& to) {
  const Pose difference = to * from.inverse();
  const Eigen::AngleAxisd turn(Matrix3(difference.linear()));
  Vector6 step;
  step << difference.translation(), turn.angle() * turn.axis();
  return step;
}

Matrix6 adjoint(const Pose& T) {
  const Matrix3 R = T.linear();
  Matrix6 A = Matrix6::Zero();
  A.topLeftCorner<3, 3>() = R;
  A.bottomRightCorner<3, 3>() = R;
  A.topRightCorner<3, 3>() = crossMatrix(T.translation()) * R;
  return A;
}

Matrix6 turnedCovariance(const Pose& T, const Matrix6& covariance) {
  const Matrix6 A = adjoint(T);
  const Matrix6 turned = A * covariance * A.transpose();
  return 0.5 * (turned + turned.transpose());
}

}  // namespace planar_mapping
