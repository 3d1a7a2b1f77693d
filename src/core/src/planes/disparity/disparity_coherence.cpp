// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/disparity/disparity_coherence.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

double cosine(const double* a, const double* b) {
  return std::fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
}

/// Whether the means of tiles lie so much nearer to the plane than single pixels that these differ
/// by noise of their own alone, not by a rough surface or by errors of matching. Where such planes
/// meet, noise mixes their pixels, which is no doubt about either.
bool isNoiseWhite(const DisparityPlane& plane, const std::vector<TilePart>& parts,
                  const PartList& list, const DisparityParams& params) {
  constexpr double kFullTile = 0.75 * kTileArea;
  constexpr double kShareOfFullTiles = 0.5;
  constexpr double kLeastTiles = 20.0;
  double squares = 0.0;
  double weights = 0.0;
  for (const std::size_t i : list) {
    if (parts[i].sums[kN] < kFullTile) continue;
    const double error = plane.meanError(parts[i].sums);
    squares += parts[i].sums[kN] * error * error;
    weights += parts[i].sums[kN];
  }
  const double smooth = params.white_share * plane.residual;
  return weights >= kShareOfFullTiles * plane.sums[kN] && weights >= kLeastTiles * kTileArea &&
         squares <= weights * smooth * smooth;
}

/// Share of the points in the tiles of a plane that belong to it and whose 3 x 3 tiles, as far as
/// they are on the plane, lie as the plane does or as far off as noise explains.
double agreement(const DisparityPlane& plane, const std::vector<TilePart>& parts,
                 const PartList& list, int columns, const DisparityParams& params,
                 std::vector<std::int32_t>& part_of_tile) {
  for (const std::size_t i : list) {
    part_of_tile[static_cast<std::size_t>(parts[i].tile)] = static_cast<std::int32_t>(i);
  }
  const bool white = isNoiseWhite(plane, parts, list, params);
  const double min_cosine = std::cos(params.coherent_angle);
  const int tiles = static_cast<int>(part_of_tile.size());
  double agreeing = 0.0;
  double all = 0.0;
  for (const std::size_t i : list) {
    const int tile = parts[i].tile;
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
    all += white ? parts[i].sums[kN] : parts[i].finite;
    const DisparityFit fit = fitDisparity(sums);
    if (!(fit.count > 0.0F)) continue;
    double normal[3];
    double height = 0.0;
    metricPlane(fit.p, fit.q, fit.d - fit.p * fit.x - fit.q * fit.y, params, normal, height);
    const auto isNoise = [&] {
      const double error = params.growing_factor * params.slopeError(fit.extent, fit.count);
      return std::hypot(fit.p - plane.p, fit.q - plane.q) <= error;
    };
    if (cosine(normal, plane.normal) >= min_cosine || isNoise()) agreeing += parts[i].sums[kN];
  }
  for (const std::size_t i : list) part_of_tile[static_cast<std::size_t>(parts[i].tile)] = -1;
  return agreeing / std::max(all, 1.0);
}

/// Whether a quadratic surface explains the means of the parts so much better than the plane that
/// it is none.
bool isBent(const DisparityPlane& plane, const std::vector<TilePart>& parts, const PartList& list,
            const DisparityParams& params) {
  const DisparityBend bend = bendOf(plane, parts, list, params);
  const double d = plane.sums[kZ] / plane.sums[kN];
  return bend.angle > params.bent_angle && bend.advantage > params.bent_advantage &&
         bend.bow > plane.pixels(params.bow_share * params.distance_threshold, d) &&
         bend.bow > std::max(params.bow_factor * params.noise,
                             params.smooth_bow_share * params.camera.disparity_error);
}

}  // namespace

DisparityBend bendOf(const DisparityPlane& plane, const std::vector<TilePart>& parts,
                     const PartList& list, const DisparityParams& params) {
  constexpr std::size_t kMinParts = 10;
  DisparityBend bend;
  if (list.size() < kMinParts) return bend;
  const double n = plane.sums[kN];
  const double cx = plane.sums[kX] / n;
  const double cy = plane.sums[kY] / n;
  const double d = plane.sums[kZ] / n;
  // Of the order of one, so that the sums of fourth powers keep their digits.
  const double scale = 1.0 / std::sqrt((plane.sums[kXX] + plane.sums[kYY]) / n - cx * cx - cy * cy);
  std::vector<Vector6> rows;
  std::vector<double> errors;
  Matrix6 squares = Matrix6::Zero();
  Vector6 products = Vector6::Zero();
  for (const std::size_t index : list) {
    const MomentSums& sums = parts[index].sums;
    const double weight = sums[kN];
    const double x = (sums[kX] / weight - cx) * scale;
    const double y = (sums[kY] / weight - cy) * scale;
    Vector6 row;
    row << 1.0, x, y, x * x, x * y, y * y;
    const double error = plane.meanError(sums);
    squares += weight * row * row.transpose();
    products += weight * error * row;
    rows.push_back(row);
    errors.push_back(error);
  }
  const Vector6 surface = squares.ldlt().solve(products);
  const Eigen::Vector3d flat = squares.topLeftCorner<3, 3>().ldlt().solve(products.head<3>());
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
  bend.advantage = (plane_error - surface_error) / 3.0 * freedom / std::max(surface_error, 1e-30);
  bend.bow = std::sqrt(std::max(0.0, plane_error - surface_error) / n);
  // A slope turns the plane by h cos / B; cos is that of the middle.
  const double f = params.camera.focal_length;
  const double range = params.factor() / d * std::sqrt(1.0 + (cx * cx + cy * cy) / (f * f));
  bend.angle = std::atan(std::sqrt(slope / n) * scale * plane.height *
                         std::min(1.0, plane.height / range) / params.camera.baseline);
  return bend;
}

std::vector<PartList> partsOfPlanes(const std::vector<TilePart>& parts, std::size_t planes) {
  std::vector<PartList> lists(planes);
  for (std::size_t part = 0; part < parts.size(); ++part) {
    lists[static_cast<std::size_t>(parts[part].label)].push_back(part);
  }
  return lists;
}

std::vector<char> coherentDisparities(const std::vector<DisparityPlane>& planes,
                                      const std::vector<TilePart>& parts, int columns, int tiles,
                                      const DisparityParams& params) {
  std::vector<char> coherent(planes.size(), 1);
  const std::vector<PartList> lists = partsOfPlanes(parts, planes.size());
  std::vector<std::int32_t> part_of_tile(static_cast<std::size_t>(tiles), -1);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (!planes[i].valid || lists[i].empty()) continue;
    const double agree = agreement(planes[i], parts, lists[i], columns, params, part_of_tile);
    const double d = planes[i].sums[kZ] / planes[i].sums[kN];
    const bool flat =
        planes[i].residual <= planes[i].pixels(params.flat_share * params.distance_threshold, d);
    if (agree < (flat ? params.min_flat_agreement : params.min_agreement) ||
        isBent(planes[i], parts, lists[i], params))
      coherent[i] = 0;
  }
  return coherent;
}

}  // namespace planar_mapping::detail
