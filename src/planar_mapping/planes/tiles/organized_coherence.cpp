// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/tiles/plane_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Fraction of the points in the tiles of a plane that belong to it and whose 3 x 3 tiles, as far
/// as they are on the plane, lie as the plane does.
double agreement(const PlaneCandidate& plane, const std::vector<TilePart>& parts,
                 const PartList& list, int columns, const PlaneFit& fit, bool own_points_only,
                 std::vector<std::int32_t>& part_of_tile) {
  for (const std::size_t i : list) {
    part_of_tile[static_cast<std::size_t>(parts[i].tile)] = static_cast<std::int32_t>(i);
  }
  CellGrid windows(static_cast<int>(list.size()), 1, 0);
  const int tiles = static_cast<int>(part_of_tile.size());
  for (std::size_t i = 0; i < list.size(); ++i) {
    const int tile = parts[list[i]].tile;
    MomentSums sums = {};
    for (int row = -1; row <= 1; ++row) {
      for (int column = -1; column <= 1; ++column) {
        const int at = tile % columns + column;
        const int other = tile + row * columns + column;
        if (at < 0 || at >= columns || other < 0 || other >= tiles) continue;
        const std::int32_t part = part_of_tile[static_cast<std::size_t>(other)];
        if (part >= 0) addSums(sums, parts[static_cast<std::size_t>(part)].sums);
      }
    }
    windows.set(i, sums);
  }
  const std::vector<char> agrees = fit.agree(plane, windows);
  double agreeing = 0.0;
  double all = 0.0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const TilePart& part = parts[list[i]];
    if (agrees[i]) agreeing += part.sums[kN];
    all += own_points_only ? part.sums[kN] : part.finite;
    part_of_tile[static_cast<std::size_t>(part.tile)] = -1;
  }
  return agreeing / std::max(all, 1.0);
}

/// Fits a quadratic surface to the means of the parts; zero where they are too few.
/// \param axes of the places of the parts
Bend bendOf(const PlaneCandidate& plane, const std::vector<TilePart>& parts, const PartList& list,
            const Vector3 (&axes)[2]) {
  constexpr std::size_t kMinParts = 10;  // six coefficients and some freedom
  Bend bend;
  if (list.size() < kMinParts) return bend;
  const double n = plane.sums[kN];
  const Vector3 centre = meanOf(plane.sums);
  std::vector<Vector6> rows;
  std::vector<double> errors;
  rows.reserve(list.size());
  errors.reserve(list.size());
  double extent = 0.0;  // places are of the order of one, so that fourth powers keep their digits
  for (const std::size_t index : list) {
    const Vector3 at = meanOf(parts[index].sums) - centre;
    const double x = axes[0].dot(at);
    const double y = axes[1].dot(at);
    Vector6 row;
    row << 1.0, x, y, x * x, x * y, y * y;
    extent += parts[index].sums[kN] * (x * x + y * y);
    rows.push_back(row);
    errors.push_back(plane.meanError(parts[index].sums));
  }
  const double scale = 1.0 / std::sqrt(extent / n);
  Vector6 scales;
  scales << 1.0, scale, scale, scale * scale, scale * scale, scale * scale;
  Matrix6 squares = Matrix6::Zero();
  Vector6 products = Vector6::Zero();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i] = rows[i].cwiseProduct(scales);
    const double weight = parts[list[i]].sums[kN];
    squares += weight * rows[i] * rows[i].transpose();
    products += weight * errors[i] * rows[i];
  }
  const Vector6 surface = squares.ldlt().solve(products);
  const Vector3 flat = squares.topLeftCorner<3, 3>().ldlt().solve(products.head<3>());
  if (!surface.allFinite() || !flat.allFinite()) return bend;
  double plane_error = 0.0;
  double surface_error = 0.0;
  double slope = 0.0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double weight = parts[list[i]].sums[kN];
    const double off_plane = errors[i] - flat.dot(rows[i].head<3>());
    const double off_surface = errors[i] - surface.dot(rows[i]);
    plane_error += weight * off_plane * off_plane;
    surface_error += weight * off_surface * off_surface;
    const double dx = surface[1] + 2.0 * surface[3] * rows[i][1] + surface[4] * rows[i][2];
    const double dy = surface[2] + surface[4] * rows[i][1] + 2.0 * surface[5] * rows[i][2];
    slope += weight * (dx * dx + dy * dy);
  }
  const double freedom = static_cast<double>(rows.size()) - 6.0;
  bend.slope = std::sqrt(slope / n) * scale;
  bend.advantage = (plane_error - surface_error) / 3.0 * freedom / std::max(surface_error, 1e-30);
  bend.bow = std::sqrt(std::max(0.0, plane_error - surface_error) / n);
  return bend;
}

}  // namespace

std::vector<PartList> partsOfPlanes(const std::vector<TilePart>& parts, std::size_t planes) {
  std::vector<PartList> lists(planes);
  for (std::size_t part = 0; part < parts.size(); ++part) {
    lists[static_cast<std::size_t>(parts[part].label)].push_back(part);
  }
  return lists;
}

std::vector<char> coherentPlanes(const std::vector<PlaneCandidate>& planes,
                                 const std::vector<TilePart>& parts, int columns, int tiles,
                                 const PlaneFit& fit) {
  std::vector<char> coherent(planes.size(), 1);
  const std::vector<PartList> lists = partsOfPlanes(parts, planes.size());
  std::vector<std::int32_t> part_of_tile(static_cast<std::size_t>(tiles), -1);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (!planes[i].valid || lists[i].empty()) continue;
    const CoherenceTest test = fit.coherenceTest(planes[i], parts, lists[i]);
    if (test.min_agreement > 0.0 &&
        agreement(planes[i], parts, lists[i], columns, fit, test.own_points_only, part_of_tile) <
            test.min_agreement) {
      coherent[i] = 0;
    } else if (!test.may_bend &&
               fit.isBent(planes[i], bendOf(planes[i], parts, lists[i], test.axes))) {
      coherent[i] = 0;
    }
  }
  return coherent;
}

}  // namespace planar_mapping::detail
