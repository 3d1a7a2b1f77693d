// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "odometry/bundle_adjustment.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "odometry/motion_refinement.h"

namespace planar_mapping::detail {
namespace {

using Matrix63 = Eigen::Matrix<double, 6, 3, Eigen::DontAlign>;

double huberWeight(double squared, double limit) {
  return squared <= limit * limit ? 1.0 : limit / std::sqrt(squared);
}
double huberCost(double squared, double limit) {
  return squared <= limit * limit ? squared : limit * (2.0 * std::sqrt(squared) - limit);
}

Vector3 errorOf(const FeatureCamera& camera, const Vector3& p, const FeatureSighting& seen) {
  const FeatureSighting predicted = project(camera, p);
  return {seen.column - predicted.column, seen.row - predicted.row,
          seen.inverse_depth - predicted.inverse_depth};
}

/// A sighting behind the camera cannot be improved by small steps: it does not count.
constexpr double kBehindCost = 1e3;

class Bundle {
 public:
  Bundle(const FeatureCamera& camera, double huber_sigmas, std::vector<BundleFrame>& frames,
         std::vector<BundlePoint>& points)
      : camera_(camera),
        huber_(huber_sigmas),
        frames_(frames),
        points_(points),
        by_point_(points.size()) {
    slot_.assign(frames.size(), -1);
    for (std::size_t f = 0; f < frames.size(); ++f) {
      if (!frames[f].fixed) slot_[f] = free_++;
      for (const BundleSighting& s : frames[f].sightings) {
        by_point_[s.point].push_back({f, &s.sighting});
      }
    }
  }

  int freeFrames() const { return free_; }

  double cost() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const BundlePoint& point = points_[i];
      const Vector3 off = point.position - point.prior_position;
      sum += off.dot(point.prior_information * off);
      for (const Seen& seen : by_point_[i]) {
        const double squared = sightingDistance(camera_, frames_[seen.frame].T_sensor_world,
                                                point.position, *seen.sighting);
        sum += std::isfinite(squared) ? huberCost(squared, huber_) : kBehindCost;
      }
    }
    for (const BundleFrame& frame : frames_) {
      if (frame.fixed || !frame.prior) continue;
      const Vector6 off = motionDifference(frame.T_sensor_world, frame.prior->T_now_before);
      sum += off.dot(frame.prior->covariance.inverse() * off);
    }
    return sum;
  }

  /// One damped step.
  /// \return false if the system is singular
  bool step(double damping) {
    const Eigen::Index size = 6 * free_;
    Eigen::MatrixXd reduced = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    std::vector<PointSystem> systems(points_.size());
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (!addPoint(i, damping, systems[i], reduced, right)) return false;
    }
    addPriors(reduced, right);
    for (Eigen::Index k = 0; k < size; ++k) reduced(k, k) *= 1.0 + damping;
    for (std::size_t i = 0; i < points_.size(); ++i) eliminate(systems[i], reduced, right);
    const Eigen::LDLT<Eigen::MatrixXd> solver(reduced);
    if (solver.info() != Eigen::Success || !solver.isPositive()) return false;
    const Eigen::VectorXd moved = solver.solve(right);
    if (!moved.allFinite()) return false;
    for (std::size_t i = 0; i < points_.size(); ++i) movePoint(systems[i], moved, points_[i]);
    for (std::size_t f = 0; f < frames_.size(); ++f) {
      if (slot_[f] < 0) continue;
      Pose& pose = frames_[f].T_sensor_world;
      pose = motionStep(Vector6(moved.segment<6>(6 * slot_[f]))) * pose;
      pose.linear() = Eigen::Quaterniond(Matrix3(pose.linear())).normalized().toRotationMatrix();
    }
    return true;
  }

 private:
  struct Seen {
    std::size_t frame;
    const FeatureSighting* sighting;
  };
  struct Coupling {
    int slot;
    Matrix63 block;
  };
  /// Normal equations of one point and its coupling to the free frames.
  struct PointSystem {
    Matrix3 inverse = Matrix3::Zero();
    Vector3 right = Vector3::Zero();
    std::vector<Coupling> couplings;
  };

  bool addPoint(std::size_t i, double damping, PointSystem& system, Eigen::MatrixXd& reduced,
                Eigen::VectorXd& right) const {
    const BundlePoint& point = points_[i];
    Matrix3 hessian = point.prior_information;
    system.right = point.prior_information * (point.prior_position - point.position);
    for (const Seen& seen : by_point_[i]) {
      const Pose& pose = frames_[seen.frame].T_sensor_world;
      const Vector3 p = pose * point.position;
      if (!(p.z() > kNearestDepth)) continue;
      const Vector3 error = errorOf(camera_, p, *seen.sighting);
      Vector3 weight = sightingVariance(camera_, seen.sighting->inverse_depth).cwiseInverse();
      weight *= huberWeight(error.dot(weight.cwiseProduct(error)), huber_);
      const Matrix3 at_p = projectionJacobian(camera_, p);
      const Matrix3 at_point = at_p * pose.linear();
      const Matrix3 weighted = weight.asDiagonal() * at_point;
      hessian.noalias() += at_point.transpose() * weighted;
      system.right.noalias() += weighted.transpose() * error;
      const int slot = slot_[seen.frame];
      if (slot < 0) continue;
      Matrix3 turned;
      turned << 0.0, p.z(), -p.y(), -p.z(), 0.0, p.x(), p.y(), -p.x(), 0.0;
      Eigen::Matrix<double, 3, 6> at_pose;
      at_pose << at_p, at_p * turned;
      reduced.block<6, 6>(6 * slot, 6 * slot).noalias() +=
          at_pose.transpose() * (weight.asDiagonal() * at_pose);
      right.segment<6>(6 * slot).noalias() += at_pose.transpose() * weight.cwiseProduct(error);
      system.couplings.push_back({slot, at_pose.transpose() * weighted});
    }
    hessian.diagonal() *= 1.0 + damping;
    return system.couplings.empty() || invertCovariance(hessian, system.inverse);
  }

  void addPriors(Eigen::MatrixXd& reduced, Eigen::VectorXd& right) const {
    for (std::size_t f = 0; f < frames_.size(); ++f) {
      if (slot_[f] < 0 || !frames_[f].prior) continue;
      const Matrix6 information = frames_[f].prior->covariance.inverse();
      const Vector6 off =
          motionDifference(frames_[f].T_sensor_world, frames_[f].prior->T_now_before);
      reduced.block<6, 6>(6 * slot_[f], 6 * slot_[f]) += information;
      right.segment<6>(6 * slot_[f]) += information * off;
    }
  }

  static void eliminate(const PointSystem& system, Eigen::MatrixXd& reduced,
                        Eigen::VectorXd& right) {
    for (const Coupling& a : system.couplings) {
      const Matrix63 solved = a.block * system.inverse;
      right.segment<6>(6 * a.slot).noalias() -= solved * system.right;
      for (const Coupling& b : system.couplings) {
        if (b.slot > a.slot) continue;
        reduced.block<6, 6>(6 * a.slot, 6 * b.slot).noalias() -= solved * b.block.transpose();
      }
    }
  }

  static void movePoint(const PointSystem& system, const Eigen::VectorXd& moved,
                        BundlePoint& point) {
    if (system.couplings.empty()) return;
    Vector3 right = system.right;
    for (const Coupling& coupling : system.couplings) {
      right.noalias() -= coupling.block.transpose() * moved.segment<6>(6 * coupling.slot);
    }
    point.position += system.inverse * right;
  }

  const FeatureCamera& camera_;
  double huber_;
  std::vector<BundleFrame>& frames_;
  std::vector<BundlePoint>& points_;
  std::vector<std::vector<Seen>> by_point_;
  std::vector<int> slot_;
  int free_ = 0;
};

}  // namespace

bool adjustBundle(const FeatureCamera& camera, double huber_sigmas, int iterations,
                  std::vector<BundleFrame>& frames, std::vector<BundlePoint>& points) {
  constexpr double kSettled = 1e-4;  // relative decrease that is not worth another iteration
  Bundle bundle(camera, huber_sigmas, frames, points);
  if (bundle.freeFrames() == 0 || points.empty()) return false;
  double cost = bundle.cost();
  double damping = 1e-4;
  bool improved = false;
  for (int i = 0; i < iterations; ++i) {
    std::vector<Pose> poses_before;
    poses_before.reserve(frames.size());
    for (const BundleFrame& frame : frames) poses_before.push_back(frame.T_sensor_world);
    const std::vector<BundlePoint> points_before = points;
    const bool solved = bundle.step(damping);
    const double next = solved ? bundle.cost() : std::numeric_limits<double>::infinity();
    if (next < cost) {
      const bool settled = cost - next < kSettled * cost;
      cost = next;
      improved = true;
      damping *= 0.1;
      if (settled) break;
    } else {
      points = points_before;
      for (std::size_t f = 0; f < frames.size(); ++f) frames[f].T_sensor_world = poses_before[f];
      damping *= 10.0;
      if (damping > 1e4) break;
    }
  }
  return improved;
}

double sightingDistance(const FeatureCamera& camera, const Pose& T_sensor_world,
                        const Vector3& point, const FeatureSighting& sighting) {
  const Vector3 p = T_sensor_world * point;
  if (!(p.z() > kNearestDepth)) return std::numeric_limits<double>::infinity();
  const Vector3 error = errorOf(camera, p, sighting);
  return error.cwiseAbs2().dot(sightingVariance(camera, sighting.inverse_depth).cwiseInverse());
}

bool sightingInformation(const FeatureCamera& camera, const Pose& T_sensor_world,
                         const Vector3& point, const FeatureSighting& sighting,
                         Matrix3& information, Vector3& position) {
  const Vector3 p = T_sensor_world * point;
  if (!(p.z() > kNearestDepth)) return false;
  const Matrix3 jacobian = projectionJacobian(camera, p) * T_sensor_world.linear();
  const Vector3 weight = sightingVariance(camera, sighting.inverse_depth).cwiseInverse();
  information = jacobian.transpose() * weight.asDiagonal() * jacobian;
  position = point + jacobian.inverse() * errorOf(camera, p, sighting);
  return information.allFinite() && position.allFinite();
}

}  // namespace planar_mapping::detail
