// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/surface_map.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "planar_mapping/core/error.h"
#include "planar_mapping/core/motion_estimation.h"
#include "planar_mapping/core/occupancy.h"
#include "surface_cells.h"

namespace planar_mapping {
namespace {

constexpr double kUnknownTranslation = 1.0;  // metres, see CloudRegistration
constexpr double kUnknownRotation = 0.5;     // radians

Matrix6 weakInformation() {
  Vector6 information;
  information << Vector3::Constant(1.0 / (kUnknownTranslation * kUnknownTranslation)),
      Vector3::Constant(1.0 / (kUnknownRotation * kUnknownRotation));
  return Matrix6(information.asDiagonal());
}

/// Calls what(point, its depth error) for the points that count.
template <typename What>
void forSample(const PointsView& cloud, const SurfaceMapParams& params, const What& what) {
  const auto most = static_cast<std::size_t>(params.sample_size);
  // Points that are not there are not looked at either.
  std::vector<std::size_t> finite;
  finite.reserve(cloud.size);
  for (std::size_t i = 0; i < cloud.size; ++i) {
    if (cloud.isFinite(i)) finite.push_back(i);
  }
  // Not a divisor of the width, so that it does not pick single columns.
  std::size_t step = finite.size() / most + 1;
  if (step > 1 && cloud.isOrganized() && cloud.width % step == 0) ++step;
  for (std::size_t k = 0; k < finite.size(); k += step) {
    const Vector3 p = cloud.point(finite[k]);
    const double range = p.norm();
    if (!(range > 0.0) || (params.max_range > 0.0 && range > params.max_range)) continue;
    const double depth = depthOf(p, params.optical_axis);
    const double along = depth > 0.0 ? range / depth : 1.0;
    what(p, along * (params.depth_error + params.depth_error_growth * depth * depth));
  }
}

struct Equations {
  Matrix6 hessian = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  double squared_distance = 0.0;
  double squared_error = 0.0;
  double weight = 0.0;
  std::size_t matched = 0;
};

}  // namespace

void SurfaceMapParams::validate() const {
  constexpr double kLargest = std::numeric_limits<double>::max();
  requirePositive("cell", cell, "m");
  requireInRange("levels", levels, 1, 6);
  requireInRange("min_points", min_points, 4, kLargest);
  requirePositive("max_thickness", max_thickness);
  if (!(max_normal_angle > 0.0 && max_normal_angle < M_PI / 2.0)) {
    throw ParameterError("max_normal_angle", max_normal_angle, "(0, pi/2)", "rad");
  }
  requireInRange("max_range", max_range, 0.0, kLargest, "m");
  requireInRange("depth_error", depth_error, 0.0, kLargest, "m");
  requireInRange("depth_error_growth", depth_error_growth, 0.0, kLargest, "1/m");
  requirePositive("depth_error + depth_error_growth", depth_error + depth_error_growth);
  if (!optical_axis.allFinite()) {
    throw ParameterError("optical_axis", optical_axis.sum(), "finite");
  }
  requireInRange("sample_size", sample_size, 100, kLargest);
  requireInRange("iterations", iterations, 1, kLargest);
  requireInRange("min_share", min_share, 0.0, 1.0);
  requireInRange("correlated_planes", correlated_planes, 1.0, kLargest);
  requireInRange("max_cells", max_cells, 1000, kLargest);
}

class SurfaceMap::Implementation {
 public:
  explicit Implementation(const SurfaceMapParams& params) : params_(params) {
    params.validate();
    for (int level = 0; level < params.levels; ++level) {
      levels_.emplace_back(params.cell * std::ldexp(1.0, level));
    }
  }

  void insert(const PointsView& cloud, const Pose& T_world_sensor) {
    ++frame_;
    const Vector3 sensor = T_world_sensor.translation();
    forSample(cloud, params_, [&](const Vector3& p, double error) {
      const Vector3 q = T_world_sensor * p;
      for (detail::SurfaceCells& level : levels_) level.add(q, sensor, error, frame_);
    });
    for (detail::SurfaceCells& level : levels_) {
      level.fit(params_);
      level.limit(static_cast<std::size_t>(params_.max_cells));
    }
  }

  CloudRegistration locate(const PointsView& cloud, const Pose& guess) const {
    CloudRegistration result;
    std::vector<std::vector<detail::Surfel>> planes;
    for (const detail::SurfaceCells& level : levels_)
      planes.push_back(planesOf(cloud, level.cell()));
    Pose pose = guess.inverse();
    if (!approach(planes.front(), pose)) return result;
    for (std::size_t level = levels_.size(); level-- > 0;) {
      if (!refine(level, planes[level], pose)) return result;
    }
    const std::vector<detail::Surfel>& finest = planes.front();
    const Equations at_end = equations(0, finest, pose, 0.0);
    result.planes = finest.size();
    result.matched = at_end.matched;
    if (at_end.matched < 6) return result;
    const double ratio = at_end.squared_error / static_cast<double>(at_end.matched);
    const Matrix6 information =
        at_end.hessian / (params_.correlated_planes * std::max(1.0, ratio)) + weakInformation();
    result.covariance = Eigen::LDLT<Matrix6>(information).solve(Matrix6::Identity());
    result.covariance = 0.5 * (result.covariance + result.covariance.transpose()).eval();
    result.rms = std::sqrt(at_end.squared_distance / static_cast<double>(at_end.matched));
    result.T_world_sensor = pose.inverse();
    result.found = static_cast<double>(at_end.matched) >=
                   params_.min_share * static_cast<double>(finest.size());
    return result;
  }

  const SurfaceMapParams& params() const { return params_; }
  std::size_t cells() const { return levels_.front().size(); }

 private:
  /// Planes of a cloud, sensor's frame.
  std::vector<detail::Surfel> planesOf(const PointsView& cloud, double cell) const {
    detail::SurfaceCells cells(cell);
    forSample(cloud, params_,
              [&](const Vector3& p, double error) { cells.add(p, Vector3::Zero(), error, 0); });
    cells.fit(params_);
    return cells.planes();
  }

  /// Robust normal equations of T_sensor_world; \p tolerance on top of the noise lets planes count
  /// that are not yet in place.
  Equations equations(std::size_t level, const std::vector<detail::Surfel>& planes,
                      const Pose& T_sensor_world, double tolerance) const {
    constexpr double kSigmas = 2.5;  // beyond, a plane is on something else
    const Pose T_world_sensor = T_sensor_world.inverse();
    const Matrix3 R = T_world_sensor.linear();
    const double min_cosine = std::cos(params_.max_normal_angle);
    Equations sum;
    for (const detail::Surfel& plane : planes) {
      const Vector3 q = T_world_sensor * plane.center;
      const Vector3 normal = R * plane.normal;
      const detail::Surfel* target = levels_[level].nearest(q, normal, min_cosine);
      if (target == nullptr) continue;
      const double distance = target->normal.dot(q - target->center);
      const double slant = plane.center.normalized().dot(plane.normal);
      const double variance = slant * slant * plane.error * plane.error +
                              target->deviation * target->deviation + tolerance * tolerance;
      const double squared = distance * distance / variance;
      if (squared > kSigmas * kSigmas) continue;
      const double fade = 1.0 - squared / (kSigmas * kSigmas);
      const double weight = fade * fade / variance;
      // Distance of the plane's centre, of the error of T_sensor_world in the sensor's frame: where
      // the map's plane lies as the sensor sees it.
      const Vector3 n = R.transpose() * target->normal;
      Vector6 jacobian;
      jacobian << n, plane.center.cross(n);
      sum.hessian.noalias() += weight * jacobian * jacobian.transpose();
      sum.gradient.noalias() += weight * distance * jacobian;
      sum.squared_distance += distance * distance;
      sum.squared_error += squared;
      ++sum.matched;
    }
    return sum;
  }

  /// Brings the cloud near: each plane is drawn to the next one in the map that faces the same way,
  /// first from afar.
  bool approach(const std::vector<detail::Surfel>& planes, Pose& pose) const {
    constexpr std::size_t kFewest = 6;
    constexpr double kShrink = 0.8;
    const std::vector<detail::Surfel> targets = levels_.front().planes();
    const double min_cosine = std::cos(params_.max_normal_angle);
    for (double reach = params_.reach; reach > levels_.back().cell(); reach *= kShrink) {
      const Pose T_world_sensor = pose.inverse();
      Equations sum;
      for (const detail::Surfel& plane : planes) {
        const Vector3 q = T_world_sensor * plane.center;
        const Vector3 normal = T_world_sensor.linear() * plane.normal;
        const detail::Surfel* target = nullptr;
        double nearest = reach * reach;
        for (const detail::Surfel& candidate : targets) {
          const double squared = (candidate.center - q).squaredNorm();
          if (squared < nearest && candidate.normal.dot(normal) >= min_cosine) {
            nearest = squared;
            target = &candidate;
          }
        }
        if (target == nullptr) continue;
        const Vector3 n = T_world_sensor.linear().transpose() * target->normal;
        Vector6 jacobian;
        jacobian << n, plane.center.cross(n);
        const double distance = target->normal.dot(q - target->center);
        const double slant = plane.center.normalized().dot(plane.normal);
        const double soft = 0.2 * reach;
        const double variance = slant * slant * plane.error * plane.error +
                                target->deviation * target->deviation + soft * soft;
        const double ratio = 1.0 + distance * distance / variance;
        const double weight = 1.0 / (variance * ratio);
        sum.hessian.noalias() += weight * jacobian * jacobian.transpose();
        sum.gradient.noalias() += weight * distance * jacobian;
        ++sum.matched;
      }
      if (sum.matched < kFewest) return false;
      const Vector6 step = Eigen::LDLT<Matrix6>(sum.hessian + weakInformation()).solve(sum.gradient);
      if (!step.allFinite()) return false;
      pose = motionStep(step) * pose;
    }
    return true;
  }

  bool refine(std::size_t level, const std::vector<detail::Surfel>& planes, Pose& pose) const {
    constexpr double kSettled = 1e-5;
    constexpr std::size_t kFewest = 6;
    const double reach = 0.5 * levels_[level].cell();
    double tolerance = 0.5 * reach;
    for (int i = 0; i < params_.iterations; ++i) {
      const Equations sum = equations(level, planes, pose, tolerance);
      if (sum.matched < kFewest) return false;
      // Directions the planes say nothing about stay as they were.
      const Eigen::LDLT<Matrix6> solver(sum.hessian + weakInformation());
      const Vector6 step = solver.solve(sum.gradient);
      if (!step.allFinite()) return false;
      pose = motionStep(step) * pose;
      pose.linear() = Eigen::Quaterniond(Matrix3(pose.linear())).normalized().toRotationMatrix();
      tolerance *= 0.7;
      if (step.norm() < kSettled && tolerance < 0.1 * reach) break;
    }
    return true;
  }

  SurfaceMapParams params_;
  std::vector<detail::SurfaceCells> levels_;
  std::int64_t frame_ = 0;
};

SurfaceMap::SurfaceMap(const SurfaceMapParams& params)
    : implementation_(std::make_unique<Implementation>(params)) {}
SurfaceMap::~SurfaceMap() = default;
SurfaceMap::SurfaceMap(const SurfaceMap& other)
    : implementation_(std::make_unique<Implementation>(*other.implementation_)) {}
SurfaceMap& SurfaceMap::operator=(const SurfaceMap& other) {
  if (this != &other) implementation_ = std::make_unique<Implementation>(*other.implementation_);
  return *this;
}
SurfaceMap::SurfaceMap(SurfaceMap&&) noexcept = default;
SurfaceMap& SurfaceMap::operator=(SurfaceMap&&) noexcept = default;

const SurfaceMapParams& SurfaceMap::params() const {
  return implementation_->params();
}

void SurfaceMap::insert(const PointsView& cloud, const Pose& T_world_sensor) {
  if (!T_world_sensor.matrix().allFinite()) throw InputError("the pose of a cloud is not finite");
  implementation_->insert(cloud, T_world_sensor);
}

CloudRegistration SurfaceMap::locate(const PointsView& cloud, const Pose& guess) const {
  if (!guess.matrix().allFinite()) throw InputError("the guessed pose of a cloud is not finite");
  return implementation_->locate(cloud, guess);
}

std::size_t SurfaceMap::cells() const {
  return implementation_->cells();
}

}  // namespace planar_mapping
