// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/surface_map.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "planar_mapping/core/error.h"
#include "planar_mapping/core/motion_estimation.h"
#include "planar_mapping/core/occupancy.h"
#include "surface_cells.h"
#include "surface_edges.h"

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

constexpr std::size_t kFewestPlanes = 6;

struct Equations {
  Matrix6 hessian = Matrix6::Zero();
  Matrix6 noise = Matrix6::Zero();  ///< what errors of the normals contribute to it
  Vector6 gradient = Vector6::Zero();
  double squared_distance = 0.0;
  double squared_error = 0.0;
  double score = 0.0;
  std::size_t matched = 0;

  /// What a normal that is off by a little seems to tell about the directions along its plane.
  void addNoise(const Pose& T_world_sensor, const detail::Surfel& plane,
                const detail::Surfel& target, double weight) {
    constexpr double kNormalError = 0.02;  // radians
    const Vector3 n = T_world_sensor.linear().transpose() * target.normal;
    const Vector3 u = n.unitOrthogonal();
    for (const Vector3& along : {u, Vector3(n.cross(u))}) {
      Vector6 jacobian;
      jacobian << along, plane.center.cross(along);
      noise.noalias() += weight * kNormalError * kNormalError * jacobian * jacobian.transpose();
    }
  }

  /// A plane of the cloud at this distance from one of the map. The unknown is the error of
  /// T_sensor_world in the sensor's frame: where the map's plane lies as the sensor sees it.
  void add(const Pose& T_world_sensor, const detail::Surfel& plane, const detail::Surfel& target,
           double distance, double weight) {
    const Vector3 n = T_world_sensor.linear().transpose() * target.normal;
    Vector6 jacobian;
    jacobian << n, plane.center.cross(n);
    hessian.noalias() += weight * jacobian * jacobian.transpose();
    gradient.noalias() += weight * distance * jacobian;
  }
};

}  // namespace

void SurfaceMapParams::validate() const {
  constexpr double kLargest = std::numeric_limits<double>::max();
  requirePositive("cell", cell, "m");
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
  requireInRange("edge_depth", edge_depth, 0.0, kLargest);
  requirePositive("edge_error", edge_error, "m");
  requireInRange("sample_size", sample_size, 100, kLargest);
  requirePositive("reach", reach, "m");
  requireInRange("retry_rotation", retry_rotation, 0.0, M_PI, "rad");
  requireInRange("good_share", good_share, 0.0, 1.0);
  requireInRange("iterations", iterations, 1, kLargest);
  requireInRange("min_share", min_share, 0.0, 1.0);
  requireInRange("correlated_planes", correlated_planes, 1.0, kLargest);
  requireInRange("max_cells", max_cells, 1000, kLargest);
}

namespace {

/// Without the directions that only the errors of the planes' normals seem to hold: a bare floor
/// does not keep the camera from sliding.
/// \param noise  what such errors would tell
Matrix6 meaningful(const Matrix6& information, const Matrix6& noise) {
  constexpr double kTimesNoise = 2.0;
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

/// Planes for a search through all of them.
class PlaneList {
 public:
  explicit PlaneList(bool either_way) : either_way_(either_way) {}
  void add(const detail::Surfel& plane) {
    for (int axis = 0; axis < 3; ++axis) {
      center_[axis].push_back(static_cast<float>(plane.center[axis]));
      normal_[axis].push_back(static_cast<float>(plane.normal[axis]));
    }
    planes_.push_back(plane);
  }
  /// The next plane within \p reach that faces the same way, or null.
  const detail::Surfel* nearest(const Vector3& point, const Vector3& normal, double reach,
                                double min_cosine) const {
    const auto x = static_cast<float>(point.x());
    const auto y = static_cast<float>(point.y());
    const auto z = static_cast<float>(point.z());
    const auto nx = static_cast<float>(normal.x());
    const auto ny = static_cast<float>(normal.y());
    const auto nz = static_cast<float>(normal.z());
    const auto cosine = static_cast<float>(min_cosine);
    auto best = static_cast<float>(reach * reach);
    const detail::Surfel* found = nullptr;
    for (std::size_t i = 0; i < planes_.size(); ++i) {
      const float dx = center_[0][i] - x;
      const float dy = center_[1][i] - y;
      const float dz = center_[2][i] - z;
      const float squared = dx * dx + dy * dy + dz * dz;
      if (squared >= best) continue;
      const float turned = normal_[0][i] * nx + normal_[1][i] * ny + normal_[2][i] * nz;
      if ((either_way_ ? std::abs(turned) : turned) < cosine) continue;
      best = squared;
      found = &planes_[i];
    }
    return found;
  }

 private:
  std::vector<float> center_[3];
  std::vector<float> normal_[3];
  std::vector<detail::Surfel> planes_;
  bool either_way_;  ///< lines have no side
};

/// What a cloud is registered by, sensor's frame.
struct CloudShape {
  std::vector<detail::Surfel> planes;
  std::vector<detail::Surfel> approaching;  ///< larger ones
  std::vector<detail::Surfel> edges;
};

/// The map nearby.
struct Surroundings {
  PlaneList planes{false};
  PlaneList edges{true};
};

/// A pose of a cloud and how well it lies there.
struct Candidate {
  Pose T_sensor_world = Pose::Identity();
  Equations at_end;
};

}  // namespace

class SurfaceMap::Implementation {
 public:
  explicit Implementation(const SurfaceMapParams& params)
      : params_(params),
        fine_(params.cell),
        coarse_(2.0 * params.cell),
        edges_(2.0 * params.cell, detail::CellShape::Line) {
    params.validate();
  }

  void insert(const PointsView& cloud, const Pose& T_world_sensor) {
    ++frame_;
    const Vector3 sensor = T_world_sensor.translation();
    forSample(cloud, params_, [&](const Vector3& p, double error) {
      const Vector3 q = T_world_sensor * p;
      fine_.add(q, sensor, error, frame_);
      coarse_.add(q, sensor, error, frame_);
    });
    for (const Vector3& p : detail::occludingEdges(cloud, params_)) {
      edges_.add(T_world_sensor * p, sensor, params_.edge_error, frame_);
    }
    for (detail::SurfaceCells* cells : {&fine_, &coarse_, &edges_}) {
      cells->fit(params_);
      cells->limit(static_cast<std::size_t>(params_.max_cells));
    }
  }

  CloudRegistration locate(const PointsView& cloud, const Pose& guess) const {
    const CloudShape shape = shapeOf(cloud);
    double range = params_.reach;
    for (const detail::Surfel& plane : shape.approaching) {
      range = std::max(range, plane.center.norm() + params_.reach);
    }
    Surroundings around;
    for (const detail::Surfel& plane : coarse_.planes()) {
      if ((plane.center - guess.translation()).norm() < range) around.planes.add(plane);
    }
    for (const detail::Surfel& edge : edges_.planes()) {
      if ((edge.center - guess.translation()).norm() < range) around.edges.add(edge);
    }
    Candidate best = settle(shape, around, guess.inverse());
    const auto good = params_.good_share * static_cast<double>(shape.planes.size());
    for (int turn = 0; turn < 6 && params_.retry_rotation > 0.0; ++turn) {
      if (static_cast<double>(best.at_end.matched) >= good) break;
      Vector6 step = Vector6::Zero();
      step[3 + turn / 2] = turn % 2 == 0 ? params_.retry_rotation : -params_.retry_rotation;
      Candidate other = settle(shape, around, motionStep(step) * guess.inverse());
      if (other.at_end.score > best.at_end.score) best = other;
    }
    return resultOf(best, shape.planes.size());
  }

  const SurfaceMapParams& params() const { return params_; }
  std::size_t cells() const { return fine_.size(); }

 private:
  CloudRegistration resultOf(const Candidate& candidate, std::size_t planes) const {
    CloudRegistration result;
    result.planes = planes;
    result.matched = candidate.at_end.matched;
    if (result.matched < kFewestPlanes) return result;
    const auto matched = static_cast<double>(result.matched);
    const double ratio = candidate.at_end.squared_error / matched;
    const Matrix6 information = meaningful(candidate.at_end.hessian, candidate.at_end.noise) /
                                    (params_.correlated_planes * std::max(1.0, ratio)) +
                                weakInformation();
    const Matrix6 covariance = Eigen::LDLT<Matrix6>(information).solve(Matrix6::Identity());
    result.covariance = 0.5 * (covariance + covariance.transpose());
    result.rms = std::sqrt(candidate.at_end.squared_distance / matched);
    result.T_world_sensor = candidate.T_sensor_world.inverse();
    result.found = matched >= params_.min_share * static_cast<double>(planes);
    return result;
  }

  CloudShape shapeOf(const PointsView& cloud) const {
    detail::SurfaceCells fine(fine_.cell());
    detail::SurfaceCells coarse(coarse_.cell());
    detail::SurfaceCells edges(edges_.cell(), detail::CellShape::Line);
    forSample(cloud, params_, [&](const Vector3& p, double error) {
      fine.add(p, Vector3::Zero(), error, 0);
      coarse.add(p, Vector3::Zero(), error, 0);
    });
    for (const Vector3& p : detail::occludingEdges(cloud, params_)) {
      edges.add(p, Vector3::Zero(), params_.edge_error, 0);
    }
    for (detail::SurfaceCells* cells : {&fine, &coarse, &edges}) cells->fit(params_);
    return {fine.planes(), coarse.planes(), edges.planes()};
  }

  Candidate settle(const CloudShape& shape, const Surroundings& around, const Pose& guess) const {
    Candidate candidate;
    candidate.T_sensor_world = guess;
    if (!approach(shape, around, candidate.T_sensor_world) ||
        !refine(shape, candidate.T_sensor_world)) {
      return candidate;
    }
    candidate.at_end = equations(shape, candidate.T_sensor_world, 0.0);
    return candidate;
  }

  /// Brings the cloud near: each plane is drawn to the next one in the map that faces the same way,
  /// first from afar.
  bool approach(const CloudShape& shape, const Surroundings& around, Pose& pose) const {
    constexpr double kShrink = 0.8;
    constexpr double kSoftness = 0.2;  // of the reach: distances below count in full
    constexpr std::size_t kMostPlanes = 400;
    const double min_cosine = std::cos(params_.max_normal_angle);
    const std::size_t stride = shape.approaching.size() / kMostPlanes + 1;
    for (double reach = params_.reach; reach > coarse_.cell(); reach *= kShrink) {
      const Pose T_world_sensor = pose.inverse();
      const double soft = kSoftness * reach;
      const auto weightOf = [soft](double variance, double squared) {
        return 1.0 / (variance + soft * soft + squared);
      };
      Equations sum;
      for (std::size_t i = 0; i < shape.approaching.size(); i += stride) {
        const detail::Surfel& plane = shape.approaching[i];
        const detail::Surfel* target =
            around.planes.nearest(T_world_sensor * plane.center,
                                  T_world_sensor.linear() * plane.normal, reach, min_cosine);
        if (target == nullptr) continue;
        const double distance = target->normal.dot(T_world_sensor * plane.center - target->center);
        sum.add(T_world_sensor, plane, *target, distance,
                weightOf(varianceOf(plane, *target), distance * distance));
        ++sum.matched;
      }
      for (const detail::Surfel& edge : shape.edges) {
        const detail::Surfel* target = around.edges.nearest(
            T_world_sensor * edge.center, T_world_sensor.linear() * edge.normal, reach, min_cosine);
        if (target != nullptr) addEdge(T_world_sensor, edge, *target, weightOf, sum);
      }
      if (!improve(sum, pose, nullptr)) return false;
    }
    return true;
  }

  bool refine(const CloudShape& shape, Pose& pose) const {
    constexpr double kSettled = 1e-5;
    constexpr double kShrink = 0.7;
    const double reach = fine_.cell();
    double tolerance = 0.5 * reach;
    for (int i = 0; i < params_.iterations; ++i) {
      double step = 0.0;
      if (!improve(equations(shape, pose, tolerance), pose, &step)) return false;
      tolerance *= kShrink;
      if (step < kSettled && tolerance < 0.05 * reach) break;
    }
    return true;
  }

  /// Robust normal equations; \p tolerance on top of the noise lets planes count that are not yet
  /// in place.
  Equations equations(const CloudShape& shape, const Pose& T_sensor_world, double tolerance) const {
    constexpr double kSigmas = 2.5;  // beyond, a plane is on something else
    const Pose T_world_sensor = T_sensor_world.inverse();
    const double min_cosine = std::cos(params_.max_normal_angle);
    const auto fadeOf = [](double squared) {
      return std::max(0.0, 1.0 - squared / (kSigmas * kSigmas));
    };
    Equations sum;
    for (const detail::Surfel& plane : shape.planes) {
      const Vector3 q = T_world_sensor * plane.center;
      const detail::Surfel* target =
          fine_.nearest(q, T_world_sensor.linear() * plane.normal, min_cosine);
      if (target == nullptr) continue;
      const double distance = target->normal.dot(q - target->center);
      const double variance = varianceOf(plane, *target) + tolerance * tolerance;
      const double squared = distance * distance / variance;
      const double fade = fadeOf(squared);
      if (fade <= 0.0) continue;
      sum.add(T_world_sensor, plane, *target, distance, fade * fade / variance);
      sum.addNoise(T_world_sensor, plane, *target, fade * fade / variance);
      sum.squared_distance += distance * distance;
      sum.squared_error += squared;
      sum.score += fade * fade;
      ++sum.matched;
    }
    const auto weightOf = [&](double variance, double squared) {
      const double softened = variance + tolerance * tolerance;
      const double fade = fadeOf(squared / softened);
      sum.score += fade * fade;
      return fade * fade / softened;
    };
    for (const detail::Surfel& edge : shape.edges) {
      const detail::Surfel* target = edges_.nearest(
          T_world_sensor * edge.center, T_world_sensor.linear() * edge.normal, min_cosine);
      if (target != nullptr) addEdge(T_world_sensor, edge, *target, weightOf, sum);
    }
    return sum;
  }

  /// An edge may slide along the one in the map, in the two other directions it is held.
  template <typename Weight>
  void addEdge(const Pose& T_world_sensor, const detail::Surfel& edge, const detail::Surfel& target,
               const Weight& weightOf, Equations& sum) const {
    const Vector3 off = T_world_sensor * edge.center - target.center;
    const Vector3 across = off - target.normal.dot(off) * target.normal;
    const double variance = params_.edge_error * params_.edge_error +
                            edge.deviation * edge.deviation + target.deviation * target.deviation;
    const double weight = weightOf(variance, across.squaredNorm());
    detail::Surfel side = target;
    side.normal = target.normal.unitOrthogonal();
    sum.add(T_world_sensor, edge, side, side.normal.dot(off), weight);
    side.normal = target.normal.cross(side.normal);
    sum.add(T_world_sensor, edge, side, side.normal.dot(off), weight);
  }

  static double varianceOf(const detail::Surfel& plane, const detail::Surfel& target) {
    const double slant = plane.center.normalized().dot(plane.normal);
    return slant * slant * plane.error * plane.error + target.deviation * target.deviation;
  }

  static bool improve(const Equations& sum, Pose& pose, double* step_length) {
    if (sum.matched < kFewestPlanes) return false;
    // Directions the planes say nothing about stay as they were.
    const Vector6 step = Eigen::LDLT<Matrix6>(sum.hessian + weakInformation()).solve(sum.gradient);
    if (!step.allFinite()) return false;
    pose = motionStep(step) * pose;
    pose.linear() = Eigen::Quaterniond(Matrix3(pose.linear())).normalized().toRotationMatrix();
    if (step_length != nullptr) *step_length = step.norm();
    return true;
  }

  SurfaceMapParams params_;
  detail::SurfaceCells fine_;
  detail::SurfaceCells coarse_;
  detail::SurfaceCells edges_;
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
