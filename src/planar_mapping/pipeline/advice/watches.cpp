// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/advice/watches.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping::detail {
namespace {

constexpr double kSide = 0.5;            // metres; walls farther apart are not compared
constexpr double kMaxSteep = 0.3;        // sine of the angle between a wall and the vertical
constexpr double kSameDirection = 0.95;  // cosine
constexpr std::size_t kMinPieces = 100;
constexpr std::size_t kStep = 4;  // of the points of a wall

/// The chance that two points of an organized cloud are on one plane.
double flatness(const PointsView& points) {
  MultiPlaneParams params;
  params.method = PlaneSearchMethod::Organized;
  params.distance_threshold = 0.03;
  const PlaneSet found = findPlanes(points, nullptr, params);
  const auto all = static_cast<double>(found.diagnostics.points_considered);
  double sum = 0.0;
  for (const PlaneSegment& plane : found.planes) {
    const double part = static_cast<double>(plane.inliers.size()) / all;
    sum += part * part;
  }
  return sum;
}

}  // namespace

std::vector<PoseWatch::Piece> PoseWatch::wallsOf(const PointsView& points,
                                                 const std::vector<PlaneSegment>& planes,
                                                 const Pose& T_world_sensor, const Vector3& up) {
  std::vector<Piece> pieces;
  for (const PlaneSegment& segment : planes) {
    const Vector3 normal = T_world_sensor.linear() * segment.plane.normal;
    if (std::abs(normal.dot(up)) > kMaxSteep) continue;
    for (std::size_t i = 0; i < segment.inliers.size(); i += kStep) {
      const Vector3 p = points.point(static_cast<std::size_t>(segment.inliers[i]));
      const Vector3 place =
          T_world_sensor * Vector3(p - segment.plane.signedDistance(p) * segment.plane.normal);
      const Eigen::Vector3i cell = (place / kSide).array().floor().cast<int>();
      pieces.push_back({cell.x(),
                        cell.y(),
                        cell.z(),
                        {place.x(), place.y(), place.z()},
                        {normal.x(), normal.y(), normal.z()}});
    }
  }
  // One of each wall in each cell.
  const auto keyOf = [](const Piece& a) { return std::tie(a.x, a.y, a.z, a.normal); };
  std::sort(pieces.begin(), pieces.end(),
            [&](const Piece& a, const Piece& b) { return keyOf(a) < keyOf(b); });
  pieces.erase(std::unique(pieces.begin(), pieces.end(),
                           [&](const Piece& a, const Piece& b) { return keyOf(a) == keyOf(b); }),
               pieces.end());
  return pieces;
}

std::optional<double> PoseWatch::misfit(const PointsView& points,
                                        const std::vector<PlaneSegment>& planes,
                                        const Pose& T_world_sensor,
                                        const CuboidApproximationParams& cells) {
  if (done_) return std::nullopt;
  const std::vector<Piece> now = wallsOf(points, planes, T_world_sensor, cells.up.normalized());
  const auto normalOf = [](const Piece& p) { return Vector3(p.normal.data()); };
  Matrix3 spread = Matrix3::Zero();
  for (const Piece& piece : now) spread += normalOf(piece) * normalOf(piece).transpose();
  const Vector3 usual = Eigen::SelfAdjointEigenSolver<Matrix3>(spread).eigenvectors().col(2);
  std::vector<double> distances[2];  // of walls that mostly face the direction of most, of others
  for (const Piece& piece : now) {
    const Vector3 place(piece.place.data());
    const Vector3 normal = normalOf(piece);
    double nearest = 2.0 * kSide;
    for (std::int32_t dx = -1; dx <= 1; ++dx) {
      for (std::int32_t dy = -1; dy <= 1; ++dy) {
        const auto key = [](const Piece& p) { return std::tie(p.x, p.y, p.z); };
        const Piece from{piece.x + dx, piece.y + dy, piece.z - 1, {}, {}};
        const auto less = [&](const Piece& a, const Piece& b) { return key(a) < key(b); };
        for (auto i = std::lower_bound(before_.begin(), before_.end(), from, less);
             i != before_.end() && i->x == from.x && i->y == from.y && i->z <= piece.z + 1; ++i) {
          if (normalOf(*i).dot(normal) < kSameDirection) continue;
          nearest = std::min(nearest, std::abs(normalOf(*i).dot(place - Vector3(i->place.data()))));
        }
      }
    }
    if (nearest < 2.0 * kSide)
      distances[std::abs(normal.dot(usual)) > std::sqrt(0.5) ? 0 : 1].push_back(nearest);
  }
  before_ = now;
  double misfit = 0.0;
  for (std::vector<double>& of : distances) {
    if (of.size() < kMinPieces) continue;
    misfit = std::max(misfit, ranked(of, of.size() / 2));
  }
  if (!(misfit > cells.resolution)) return std::nullopt;
  done_ = true;
  before_.clear();
  return misfit;
}

bool DepthWatch::isBentIn(const PointsView& points, bool is_only) {
  constexpr int kLooks = 5;
  constexpr int kCertain = 2;
  constexpr double kMinFlatness = 0.05;
  // Frames of 32 recordings and simulations: up to 1.01 times as flat where depths are along the
  // axis, 1.3 to 50 times (median 3.4) where they are distances.
  constexpr double kFlatter = 1.5;
  if (looks_ >= kLooks || !points.isOrganized()) return false;
  ++looks_;
  std::vector<float> xyz(3 * points.size);
  for (std::size_t i = 0; i < points.size; ++i) {
    Vector3 p = points.point(i);
    p *= p.z() / p.norm();
    for (int k = 0; k < 3; ++k) xyz[3 * i + static_cast<std::size_t>(k)] = static_cast<float>(p[k]);
  }
  const double flat = flatness(PointsView(xyz.data(), points.width, points.height, 3));
  if (flat >= kMinFlatness && flat > kFlatter * flatness(points)) ++bent_;
  const bool is_certain = bent_ >= (is_only ? 1 : kCertain);
  if (is_certain) looks_ = kLooks;
  return is_certain;
}

bool RobotWatch::isSeenIn(const PointsView& points, const Indices& indices,
                          const Pose& T_world_sensor) {
  constexpr double kNear = 0.5;  // metres
  constexpr int kCells = 20;     // of 5 cm, along each axis
  constexpr double kMinFraction = 0.1;
  constexpr double kMinTurn = 30.0 * kRadiansPerDegree;
  if (done_) return false;
  const bool is_first = !first_pose_;
  if (is_first) {
    done_ = points.isOrganized() || isCameraView(points, &indices);
    first_pose_ = T_world_sensor;
  }
  first_near_.resize(kCells * kCells * kCells);  // whatever a damaged state says
  std::size_t same = 0;
  for (const int i : indices) {
    const Vector3 p = points.point(static_cast<std::size_t>(i));
    if (!(p.norm() < kNear)) continue;
    const Eigen::Array3i at = ((p.array() + kNear) * (0.5 * kCells / kNear)).cast<int>();
    std::uint8_t& cell =
        first_near_[static_cast<std::size_t>((at[0] * kCells + at[1]) * kCells + at[2])];
    if (is_first) cell = 1;
    same += cell;
  }
  const double count = static_cast<double>(indices.size());
  done_ = done_ || static_cast<double>(same) < kMinFraction * count;
  const Pose moved = first_pose_->inverse() * T_world_sensor;
  const bool has_moved =
      moved.translation().norm() > kNear || rotationAngle(moved.linear()) > kMinTurn;
  if (done_ || !has_moved) return false;
  done_ = true;
  return true;
}

}  // namespace planar_mapping::detail
