// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/organized/organized_coherence.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Parts of one plane: indices into the list of all parts, ascending by tile.
using PartList = std::vector<std::size_t>;

// Share of the points in the tiles of a plane that belong to it and whose 3 x 3 tiles, as far as
// they are on the plane, lie as the plane does.
double agreement(const PlaneCandidate& plane, const std::vector<TilePart>& parts,
                 const PartList& list, int columns, const RangeNoise& noise, const Vector3& sensor,
                 const OrganizedParams& params, std::vector<std::int32_t>& part_of_tile) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    part_of_tile[static_cast<std::size_t>(parts[list[i]].tile)] =
        static_cast<std::int32_t>(list[i]);
  }
  CellGrid windows;
  windows.columns = static_cast<int>(list.size());
  windows.rows = 1;
  windows.allocate(nullptr);
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
    for (int m = 0; m < kMoments; ++m) windows.moment(m)[i] = sums[static_cast<std::size_t>(m)];
  }
  const std::vector<CellFit> fits = fitCells(windows, sensor);
  double agreeing = 0.0;
  double all = 0.0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const float* normal = fits[i].normal;
    const double cosine = std::fabs(normal[0] * plane.normal[0] + normal[1] * plane.normal[1] +
                                    normal[2] * plane.normal[2]);
    const double error = params.growing_factor * normalError(fits[i], noise, sensor, params);
    const double allowed =
        std::min(params.most_coherent_angle, std::max(params.coherent_angle, error));
    if (cosine >= std::cos(allowed)) agreeing += parts[list[i]].sums[kN];
    all += parts[list[i]].finite;
    part_of_tile[static_cast<std::size_t>(parts[list[i]].tile)] = -1;
  }
  return agreeing / std::max(all, 1.0);
}

/// A quadratic surface over the plane, fitted to the means of the parts.
struct Bending {
  double angle = 0.0;      ///< root mean square angle between surface and plane, radians
  double bow = 0.0;        ///< root mean square height the surface explains, metres
  double advantage = 0.0;  ///< variance ratio in favour of the quadratic surface
};

Bending bending(const PlaneCandidate& plane, const std::vector<TilePart>& parts,
                const PartList& list) {
  Bending result;
  constexpr std::size_t kMinParts = 10;
  if (list.size() < kMinParts) return result;
  const double n = plane.sums[kN];
  const Vector3 centre(plane.sums[kX] / n, plane.sums[kY] / n, plane.sums[kZ] / n);
  const Vector3 normal(plane.normal[0], plane.normal[1], plane.normal[2]);
  const Vector3 u = normal.unitOrthogonal();
  const Vector3 v = normal.cross(u);
  std::vector<Vector6> rows;
  std::vector<double> heights;
  rows.reserve(list.size());
  heights.reserve(list.size());
  Matrix6 squares = Matrix6::Zero();
  Vector6 products = Vector6::Zero();
  for (const std::size_t index : list) {
    const MomentSums& sums = parts[index].sums;
    const double weight = sums[kN];
    const Vector3 at = Vector3(sums[kX] / weight, sums[kY] / weight, sums[kZ] / weight) - centre;
    const double x = u.dot(at);
    const double y = v.dot(at);
    Vector6 row;
    row << 1.0, x, y, x * x, x * y, y * y;
    squares += weight * row * row.transpose();
    products += weight * normal.dot(at) * row;
    rows.push_back(row);
    heights.push_back(normal.dot(at));
  }
  const Vector6 q = squares.ldlt().solve(products);
  const Eigen::Vector3d flat = squares.topLeftCorner<3, 3>().ldlt().solve(products.head<3>());
  if (!q.allFinite() || !flat.allFinite()) return result;
  double plane_error = 0.0;
  double surface_error = 0.0;
  double slope = 0.0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double weight = parts[list[i]].sums[kN];
    const double off_plane = heights[i] - flat.dot(rows[i].head<3>());
    const double off_surface = heights[i] - q.dot(rows[i]);
    plane_error += weight * off_plane * off_plane;
    surface_error += weight * off_surface * off_surface;
    const double du = q[1] + 2.0 * q[3] * rows[i][1] + q[4] * rows[i][2];
    const double dv = q[2] + q[4] * rows[i][1] + 2.0 * q[5] * rows[i][2];
    slope += weight * (du * du + dv * dv);
  }
  const double freedom = static_cast<double>(rows.size()) - 6.0;
  result.angle = std::atan(std::sqrt(slope / n));
  result.bow = std::sqrt(std::max(0.0, plane_error - surface_error) / n);
  result.advantage = (plane_error - surface_error) / 3.0 * freedom / std::max(surface_error, 1e-30);
  return result;
}

/// Height that a bent surface must explain at least, metres.
double leastBow(const PlaneCandidate& plane, const RangeNoise& noise, const Vector3& sensor,
                const OrganizedParams& params) {
  const double n = plane.sums[kN];
  const Vector3 ray = Vector3(plane.sums[kX] / n, plane.sums[kY] / n, plane.sums[kZ] / n) - sensor;
  const double along = std::fabs(plane.distance(sensor.data())) / std::max(ray.norm(), 1e-9);
  const double of_tile = std::sqrt(std::min(1.0, noise.correlated_pixels / kTileArea));
  return std::max(params.bow_share * params.distance_threshold,
                  params.bow_factor * noise.at(ray.squaredNorm()) * along * of_tile);
}

}  // namespace

std::vector<char> coherentPlanes(const std::vector<PlaneCandidate>& planes,
                                 const std::vector<TilePart>& parts, int columns, int tiles,
                                 const RangeNoise& noise, const Vector3& sensor,
                                 const OrganizedParams& params) {
  std::vector<char> coherent(planes.size(), 1);
  std::vector<char> doubtful(planes.size(), 0);
  bool any = false;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    doubtful[i] =
        planes[i].valid && planes[i].width < params.straight_flatness * planes[i].residual;
    any = any || doubtful[i];
  }
  if (!any) return coherent;
  std::vector<PartList> lists(planes.size());
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const auto label = static_cast<std::size_t>(parts[part].label);
    if (doubtful[label]) lists[label].push_back(part);
  }
  std::vector<std::int32_t> part_of_tile(static_cast<std::size_t>(tiles), -1);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (!doubtful[i]) continue;
    const bool clear = planes[i].width >= params.clear_flatness * planes[i].residual;
    const double agree =
        clear ? 1.0
              : agreement(planes[i], parts, lists[i], columns, noise, sensor, params, part_of_tile);
    const Bending bent = bending(planes[i], parts, lists[i]);
    if (agree < params.min_agreement ||
        (bent.angle > params.bent_angle && bent.advantage > params.bent_advantage &&
         bent.bow > leastBow(planes[i], noise, sensor, params))) {
      coherent[i] = 0;
    }
  }
  return coherent;
}

void fitAlongRays(PlaneCandidate& plane, const std::vector<TilePart>& parts,
                  const std::vector<std::size_t>& list, const RangeNoise& noise,
                  const Vector3& sensor, const OrganizedParams& params) {
  if (!plane.valid || list.size() < 3) return;
  const double height = plane.distance(sensor.data());
  Matrix3 squares = Matrix3::Zero();
  Vector3 products = Vector3::Zero();
  double mean_range = 0.0;
  for (const std::size_t index : list) {
    const MomentSums& sums = parts[index].sums;
    const double n = sums[kN];
    const Vector3 ray = Vector3(sums[kX] / n, sums[kY] / n, sums[kZ] / n) - sensor;
    const double range = ray.norm();
    if (!(range > 0.0)) return;
    mean_range += n * range;
    // Error of 1 / r; a floor keeps the weights of noise-free clouds finite.
    const double sigma =
        noise.at(range * range) + params.smallest_noise_share * params.distance_threshold;
    const double weight = n * std::pow(range, 4) / (sigma * sigma);
    const Vector3 direction = ray / range;
    squares += weight * direction * direction.transpose();
    products += weight / range * direction;
  }
  mean_range /= plane.sums[kN];
  if (std::fabs(height) < params.min_ray_sine * mean_range) return;
  // m . direction = 1 / r describes the plane m . (p - sensor) = 1.
  const Vector3 m = squares.ldlt().solve(products);
  const double length = m.norm();
  if (!m.allFinite() || !(length > 0.0)) return;
  PlaneCandidate along = plane;
  const double sign = height > 0.0 ? -1.0 : 1.0;
  for (int axis = 0; axis < 3; ++axis) along.normal[axis] = sign * m[axis] / length;
  along.offset = sign * (-1.0 / length - m.dot(sensor) / length);
  along.residual = std::sqrt(along.meanSquare(plane.sums));
  if (along.residual <= params.max_residual_growth * plane.residual) plane = along;
}

}  // namespace planar_mapping::detail
