// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/graph_solver.h"

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>

#include "planar_mapping/geometry/angles.h"

namespace planar_mapping::detail {
namespace {

using RowMatrix67 = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;

// The loss is narrowed in steps, so that wrong links lose their pull on a solution that is still
// far off; as squared widths, of kTypicalChi2.
constexpr std::array<double, 4> kWidths = {64.0, 16.0, 4.0, 1.0};
constexpr int kIterations = 100;
constexpr double kTolerance = 1e-10;  // relative change of cost and parameters

/// Ceres and its logging say nothing on the terminal as long as this lives.
class Silence {
 public:
  Silence() : before_(FLAGS_minloglevel) { FLAGS_minloglevel = google::GLOG_FATAL; }
  ~Silence() { FLAGS_minloglevel = before_; }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  int before_;
};

/// Quaternion (x, y, z, w) and position.
struct Parameters {
  explicit Parameters(const Pose& pose) {
    Eigen::Map<Eigen::Quaterniond> turn(values.data());
    turn = Eigen::Quaterniond(Matrix3(pose.linear())).normalized();
    Eigen::Map<Vector3>(values.data() + 4) = pose.translation();
  }
  std::array<double, 7> values;
};

Pose poseOf(const double* values) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Map<const Eigen::Quaterniond>(values).toRotationMatrix();
  pose.translation() = Eigen::Map<const Vector3>(values + 4);
  return pose;
}

/// T -> T * motionStep(step). Jacobians of the cost are with respect to the step already, in the
/// first six of the seven columns.
class RightStep : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* moved) const override {
    const Eigen::Map<const Eigen::Quaterniond> turn(x);
    const Vector3 by(delta[3], delta[4], delta[5]);
    const double angle = by.norm();
    Eigen::Quaterniond step = Eigen::Quaterniond::Identity();
    if (angle > 0.0) step = Eigen::AngleAxisd(angle, by / angle);
    Eigen::Map<Eigen::Quaterniond> turned(moved);
    turned = (turn * step).normalized();
    Eigen::Map<Vector3>(moved + 4) =
        Eigen::Map<const Vector3>(x + 4) + turn * Vector3(delta[0], delta[1], delta[2]);
    return true;
  }
  bool PlusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  // The solver asks for steps only.
  bool Minus(const double* /*y*/, const double* /*x*/, double* /*d*/) const override {
    return false;
  }
  bool MinusJacobian(const double* /*x*/, double* /*jacobian*/) const override { return false; }
};

/// The error of a link, whitened: between the measured motion and T_world_to^-1 T_world_from.
class LinkCost : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  explicit LinkCost(const GraphLink& link)
      : T_from_to_(link.T_to_from.inverse()),
        whitening_(Eigen::LLT<Matrix6>(link.covariance).matrixL().solve(Matrix6::Identity())) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Matrix6 by_from;
    Matrix6 by_to;
    const bool wanted = jacobians != nullptr;
    const Vector6 xi = linkError(T_from_to_, poseOf(parameters[0]), poseOf(parameters[1]),
                                 wanted ? &by_from : nullptr, wanted ? &by_to : nullptr);
    Eigen::Map<Vector6> whitened(residuals);
    whitened = whitening_ * xi;
    if (wanted && jacobians[0] != nullptr) write(by_from, jacobians[0]);
    if (wanted && jacobians[1] != nullptr) write(by_to, jacobians[1]);
    return true;
  }

 private:
  void write(const Matrix6& J, double* out) const {
    Eigen::Map<RowMatrix67> jacobian(out);
    jacobian.leftCols<6>() = whitening_ * J;
    jacobian.col(6).setZero();
  }

  Pose T_from_to_;
  Matrix6 whitening_;
};

/// Geman and McClure: rho(s) = w s / (w + s), of the squared error s and a squared width w.
class GemanMcClure : public ceres::LossFunction {
 public:
  explicit GemanMcClure(double width) : width_(width) {}
  void Evaluate(double s, double rho[3]) const override {
    const double part = width_ / (width_ + s);
    rho[0] = s * part;
    rho[1] = part * part;
    rho[2] = -2.0 * part * part / (width_ + s);
  }

 private:
  double width_;
};

/// Poses of the nodes of one part by its links.
class PartSolver {
 public:
  PartSolver(const std::vector<GraphLink>& links, const std::vector<std::size_t>& members,
             std::vector<Pose>& poses, std::size_t fixed)
      : links_(links), members_(members), poses_(poses), fixed_(fixed) {
    for (const std::size_t member : members_) {
      for (const std::size_t node : {links[member].from, links[member].to}) {
        parameters_.try_emplace(node, poses[node]);
      }
      costs_.push_back(std::make_unique<LinkCost>(links[member]));
    }
  }

  /// \return what contradicts the solution: one flag per member
  std::vector<std::uint8_t> run() {
    solve(0.0);
    std::vector<std::uint8_t> wrong(members_.size(), 0);
    if (largestChi2() > kUnlikelyChi2) {
      for (const double width : kWidths) solve(width * kTypicalChi2);
      for (std::size_t i = 0; i < members_.size(); ++i) {
        wrong[i] = !links_[members_[i]].trusted && chi2(i) > kUnlikelyChi2 ? 1 : 0;
      }
    }
    for (const auto& [node, parameters] : parameters_) {
      if (node != fixed_) poses_[node] = poseOf(parameters.values.data());
    }
    return wrong;
  }

 private:
  void solve(double width) {
    ceres::Problem::Options ownership;
    ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ownership.disable_all_safety_checks = true;
    GemanMcClure loss(width);
    RightStep step;
    ceres::Problem problem(ownership);
    for (auto& [node, parameters] : parameters_) {
      problem.AddParameterBlock(parameters.values.data(), 7, &step);
      if (node == fixed_) problem.SetParameterBlockConstant(parameters.values.data());
    }
    for (std::size_t i = 0; i < members_.size(); ++i) {
      const bool robust = width > 0.0 && !links_[members_[i]].trusted;
      problem.AddResidualBlock(costs_[i].get(), robust ? &loss : nullptr, at(i, false),
                               at(i, true));
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    options.num_threads = 1;  // bits depend on it
    options.max_num_iterations = kIterations;
    options.function_tolerance = kTolerance;
    options.parameter_tolerance = kTolerance;
    options.gradient_tolerance = kTolerance;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
  }

  double* at(std::size_t member, bool to) {
    const GraphLink& link = links_[members_[member]];
    return parameters_.at(to ? link.to : link.from).values.data();
  }
  double chi2(std::size_t member) {
    const double* both[2] = {at(member, false), at(member, true)};
    Vector6 residuals;
    costs_[member]->Evaluate(both, residuals.data(), nullptr);
    return residuals.squaredNorm();
  }
  double largestChi2() {
    double largest = 0.0;
    for (std::size_t i = 0; i < members_.size(); ++i) largest = std::max(largest, chi2(i));
    return largest;
  }

  const std::vector<GraphLink>& links_;
  const std::vector<std::size_t>& members_;
  std::vector<Pose>& poses_;
  std::size_t fixed_;
  std::map<std::size_t, Parameters> parameters_;
  std::vector<std::unique_ptr<LinkCost>> costs_;
};

/// d log(exp(step) R) / d step where log(R) = phi.
Matrix3 inverseLeftJacobian(const Vector3& phi) {
  constexpr double kSmall = 1e-4;  // radians; the series is good to its square there
  const double angle = phi.norm();
  const double half = 0.5 * angle;
  const double factor =
      angle < kSmall ? 1.0 / 12.0 : (1.0 - half / std::tan(half)) / (angle * angle);
  const Matrix3 cross = crossMatrix(phi);
  return Matrix3::Identity() - 0.5 * cross + factor * cross * cross;
}

}  // namespace

Vector6 linkError(const Pose& T_from_to, const Pose& T_world_from, const Pose& T_world_to,
                  Matrix6* by_from, Matrix6* by_to) {
  const Pose motion = T_world_to.inverse() * T_world_from;
  const Pose error = motion * T_from_to;
  const Eigen::AngleAxisd turn(Matrix3(error.linear()));
  const Vector3 phi = turn.angle() * turn.axis();
  const Vector3 t = error.translation();
  Vector6 xi;
  xi << t, phi;
  if (by_from != nullptr) {
    const Matrix3 R = motion.linear();
    by_from->setZero();
    by_from->topLeftCorner<3, 3>() = R;
    by_from->topRightCorner<3, 3>() = -crossMatrix(t - motion.translation()) * R;
    by_from->bottomRightCorner<3, 3>() = inverseLeftJacobian(phi) * R;
  }
  if (by_to != nullptr) {
    by_to->setZero();
    by_to->topLeftCorner<3, 3>() = -Matrix3::Identity();
    by_to->topRightCorner<3, 3>() = crossMatrix(t);
    by_to->bottomRightCorner<3, 3>() = -inverseLeftJacobian(phi);
  }
  return xi;
}

std::vector<std::uint8_t> solvePart(const std::vector<GraphLink>& links,
                                    const std::vector<std::size_t>& members,
                                    std::vector<Pose>& poses, std::size_t fixed) {
  const Silence silence;
  return PartSolver(links, members, poses, fixed).run();
}

}  // namespace planar_mapping::detail
