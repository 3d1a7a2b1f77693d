// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/view_alignment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "planar_mapping/geometry/angles.h"

namespace planar_mapping::detail {
namespace {

constexpr int kCoarseRounds = 15;
constexpr int kFineRounds = 8;
constexpr double kWidest = 10.0;    // sigmas: width of the Cauchy weight in the first round,
constexpr double kNarrowest = 2.0;  // and in the last
constexpr double kReach = 0.15;     // of the depth: what is farther off is another surface
constexpr double kLeastSurfaceSigma = 0.003;  // metres: a cell is no plane
constexpr double kErrorsTogether = 20.0;      // neighbouring cells err together
constexpr double kNearest = 0.05;             // metres

/// Normal equations, lower triangle row by row.
struct Sums {
  std::array<double, 21> H{};
  std::array<double, 6> g{};

  void add(const std::array<double, 6>& J, double residual, double weight) {
    std::size_t k = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      const double weighted = weight * J[i];
      for (std::size_t j = 0; j <= i; ++j) H[k++] += weighted * J[j];
      g[i] -= weighted * residual;
    }
  }
  Matrix6 hessian() const {
    Matrix6 full;
    std::size_t k = 0;
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j <= i; ++j) full(i, j) = full(j, i) = H[k++];
    }
    return full;
  }
  Vector6 gradient() const { return Vector6(g.data()); }
};

/// A cell of the map in the frame of the view: both residuals.
void addCell(const ViewCell& cell, const Vector3& q, const View& now, const ViewCells& cells,
             double width, Sums& sums) {
  if (q.z() < kNearest) return;
  const double w = 1.0 / q.z();
  const double column = cells.placeOf(now.camera.fx * q.x() * w + now.camera.cx);
  const double row = cells.placeOf(now.camera.fy * q.y() * w + now.camera.cy);
  if (!(column >= 1.0 && row >= 1.0 && column < cells.across - 2 && row < cells.down - 2)) return;
  const ViewCell& there = cells.at(static_cast<int>(column + 0.5), static_cast<int>(row + 0.5));
  // Cauchy's weight: 1 / (variance (1 + residual^2 / (variance width^2))).
  const double narrow = 1.0 / (width * width);
  const auto weightOf = [&](double residual, double variance) {
    return 1.0 / (variance + residual * residual * narrow);
  };
  if (there.hasDepth() && there.hasNormal()) {
    const Vector3 normal = there.normal.cast<double>();
    const double residual = normal.dot(q - there.point.cast<double>());
    if (std::abs(residual) > kReach * q.z()) return;
    const double incidence = std::abs(normal.dot(q)) * w;
    const double z = q.z();
    const double along = z * z * incidence;
    const double variance =
        double{there.sigma * there.sigma + cell.sigma * cell.sigma} * along * along +
        kLeastSurfaceSigma * kLeastSurfaceSigma;
    const Vector3 turn = q.cross(normal);
    sums.add({normal.x(), normal.y(), normal.z(), turn.x(), turn.y(), turn.z()}, residual,
             weightOf(residual, variance));
  }
  const int x = static_cast<int>(column);
  const int y = static_cast<int>(row);
  const double a = column - x;
  const double b = row - y;
  const auto gray = [&](int u, int v) { return double{cells.at(x + u, y + v).gray}; };
  const double g00 = gray(0, 0), g10 = gray(1, 0), g01 = gray(0, 1), g11 = gray(1, 1);
  const double value = (1 - b) * ((1 - a) * g00 + a * g10) + b * ((1 - a) * g01 + a * g11);
  const double gx = ((1 - b) * (g10 - g00) + b * (g11 - g01)) / cells.side;
  const double gy = ((1 - a) * (g01 - g00) + a * (g11 - g10)) / cells.side;
  const double residual = value - double{cell.gray};
  const double variance =
      double{there.gray_sigma * there.gray_sigma + cell.gray_sigma * cell.gray_sigma};
  const Vector3 gradient(gx * now.camera.fx * w, gy * now.camera.fy * w,
                         -(gx * now.camera.fx * q.x() + gy * now.camera.fy * q.y()) * w * w);
  const Vector3 turn = q.cross(gradient);
  sums.add({gradient.x(), gradient.y(), gradient.z(), turn.x(), turn.y(), turn.z()}, residual,
           weightOf(residual, variance));
}

}  // namespace

Alignment alignViews(const LocalMap& map, const View& now, const Pose& start, AlignLevel level) {
  const bool coarse = level != AlignLevel::Refine;
  Alignment result;
  result.T_now_map = start;
  const ViewCells& cells = coarse ? now.coarse : now.fine;
  const int rounds = level == AlignLevel::Search ? kCoarseRounds : kFineRounds;
  // Half of the cells, in a chequered pattern.
  for (int round = 0; round < rounds; ++round) {
    const double width =
        level != AlignLevel::Refine
            ? kWidest * std::pow(kNarrowest / kWidest, double(round) / (rounds - 1))
            : kNarrowest;
    Sums sums;
    for (const PlacedView& placed : map) {
      const Pose T = result.T_now_map * placed.T_map_view;
      const Matrix3 R = T.linear();
      const Vector3 t = T.translation();
      const ViewCells& from = coarse ? placed.view->coarse : placed.view->fine;
      for (int row = 0; row < from.down; ++row) {
        for (int column = row % 2; column < from.across; column += 2) {
          const ViewCell& cell = from.at(column, row);
          if (!cell.hasDepth()) continue;
          addCell(cell, R * cell.point.cast<double>() + t, now, cells, width, sums);
        }
      }
    }
    Matrix6 H = sums.hessian();
    result.information = H / (kErrorsTogether * static_cast<double>(map.size()));
    // What surfaces leave open stays as it was.
    const double trace_t = H.topLeftCorner<3, 3>().trace();
    const double trace_r = H.bottomRightCorner<3, 3>().trace();
    if (!(trace_t > 0.0) || !(trace_r > 0.0)) break;
    H.diagonal().head<3>().array() += 1e-6 * trace_t;
    H.diagonal().tail<3>().array() += 1e-6 * trace_r;
    const Vector6 step = Eigen::LDLT<Eigen::Matrix<double, 6, 6>>(H).solve(sums.gradient());
    if (!step.allFinite()) break;
    result.T_now_map = motionStep(step) * result.T_now_map;
    if (step.head<3>().norm() < 1e-4 && step.tail<3>().norm() < 1e-4 &&
        (round > rounds / 2 || level == AlignLevel::Refine))
      break;
  }
  result.T_now_map.linear() =
      Eigen::Quaterniond(Matrix3(result.T_now_map.linear())).normalized().toRotationMatrix();
  return result;
}

std::vector<Pose> startsAround(const Pose& T_now_map, double depth) {
  constexpr std::array<double, 3> kAngles = {10.0, 20.0, 32.0};
  std::vector<Pose> starts;
  const auto turned = [&](double degrees, const Vector3& axis, double about) {
    Pose turn = Pose::Identity();
    turn.linear() = Eigen::AngleAxisd(degrees * kRadiansPerDegree, axis).toRotationMatrix();
    const Vector3 center(0.0, 0.0, about);
    turn.translation() = center - turn.linear() * center;
    starts.push_back(turn * T_now_map);
  };
  for (const double angle : kAngles) {
    for (const double sign : {-1.0, 1.0}) {
      turned(sign * angle, Vector3::UnitY(), 0.0);
      turned(sign * angle, Vector3::UnitY(), depth);
    }
  }
  for (const double sign : {-1.0, 1.0}) turned(sign * kAngles[0], Vector3::UnitX(), 0.0);
  return starts;
}

}  // namespace planar_mapping::detail
