// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "planar_mapping/base/point_indices.h"
#include "planar_mapping/planes/disparity/disparity_fit.h"
#include "planar_mapping/planes/organized/organized_steps.h"
#include "planar_mapping/planes/plane_search.h"

namespace planar_mapping::detail {
namespace {

/// Whether the errors of pixels cancel within tiles, as those of matching do and the relief of a
/// rough surface does not.
bool areTilesSmoother(const PlaneCandidate& plane, const std::vector<TilePart>& parts,
                      const PartList& list, const DisparityParams& params) {
  double squares = 0.0;
  for (const std::size_t i : list) {
    const double error = plane.meanError(parts[i].sums);
    squares += parts[i].sums[kN] * error * error;
  }
  const double most = params.noise_tile_fraction * plane.residual;
  return squares <= plane.sums[kN] * most * most;
}

/// Whether noise alone explains what lies off a plane that is thick for its width, as a trunk, a
/// shrub or a cushion is not explained: the residual is no larger than the noise of the frame and
/// much smaller in means of tiles.
bool isNoiseOfPlane(const PlaneCandidate& plane, const std::vector<TilePart>& parts,
                    const PartList& list, const DisparityParams& params) {
  return list.size() >= static_cast<std::size_t>(params.least_noisy_tiles) &&
         plane.residual <= params.most_noisy_residual * params.noise &&
         areTilesSmoother(plane, parts, list, params);
}

/// Moments in metres of the points of a part, carried along their rays onto the plane.
PlaneMoments onPlane(const PlaneCandidate& plane, const MomentSums& sums,
                     const DisparityParams& params) {
  const double n = sums[kN];
  const double f = params.camera.focal_length;
  const double x = sums[kX] / n;
  const double y = sums[kY] / n;
  // P = (X, Y, f) B / D with D = p X + q Y + r, and its derivatives by X and Y.
  const double d = plane.normal[0] * x + plane.normal[1] * y + plane.offset;
  const double scale = params.camera.baseline / d;
  const Vector3 ray(x, y, f);
  const Vector3 by_x = scale * (Vector3::UnitX() - plane.normal[0] / d * ray);
  const Vector3 by_y = scale * (Vector3::UnitY() - plane.normal[1] / d * ray);
  const double xx = sums[kXX] - n * x * x;
  const double xy = sums[kXY] - n * x * y;
  const double yy = sums[kYY] - n * y * y;
  const Matrix3 outer = xx * by_x * by_x.transpose() + yy * by_y * by_y.transpose() +
                        xy * (by_x * by_y.transpose() + by_y * by_x.transpose());
  return PlaneMoments::fromSums(n, Vector3::Zero(), outer, scale * ray);
}

/// Sum of the squared distances of the points of a part from the plane, square metres.
double squaresOf(const PlaneCandidate& plane, const TilePart& part) {
  const double metres = plane.height * part.sums[kN] / part.sums[kZ];
  return part.sums[kN] * plane.meanSquare(part.sums) * metres * metres;
}

/// Covariance of (a, b, c, d) from that of the regression.
Matrix4 covarianceOf(const PlaneCandidate& plane, const DisparityParams& params) {
  const MomentSums& s = plane.sums;
  Matrix3 squares;
  squares << s[kXX], s[kXY], s[kX], s[kXY], s[kYY], s[kY], s[kX], s[kY], s[kN];
  const double variance = plane.residual * plane.residual * kCorrelatedPixels;
  const Matrix3 of_slopes = variance * squares.inverse();
  // (a, b, c, d) = (-m, B f) / |m| with m = (p f, q f, r), turned towards the sensor.
  const double f = params.camera.focal_length;
  const Vector3 m(plane.normal[0] * f, plane.normal[1] * f, plane.offset);
  const double length = m.norm();
  const Vector3 unit = m / length;
  Eigen::Matrix<double, 4, 3> jacobian;
  jacobian.topRows<3>() = -(Matrix3::Identity() - unit * unit.transpose()) / length;
  jacobian.row(3) = -params.factor() / (length * length) * unit.transpose();
  const Eigen::Matrix<double, 4, 3> by_slopes = jacobian * Vector3(f, f, 1.0).asDiagonal();
  const Matrix4 covariance = by_slopes * of_slopes * by_slopes.transpose();
  return covariance.allFinite() ? covariance : Matrix4::Zero();
}

/// Standard deviations of the points of a plane, metres.
struct Extent {
  double across = 0.0;  ///< the plane
  double along = 0.0;   ///< its narrower side
};

/// Of the planes that are asked for.
std::vector<Extent> extentsOf(const std::vector<PlaneCandidate>& planes,
                              const std::vector<TilePart>& parts, const std::vector<char>& asked,
                              const DisparityParams& params) {
  std::vector<PlaneMoments> moments(planes.size());
  std::vector<Extent> extents(planes.size());
  for (const TilePart& part : parts) {
    const auto i = static_cast<std::size_t>(part.label);
    if (asked[i] == 0) continue;
    moments[i].merge(onPlane(planes[i], part.sums, params));
    extents[i].across += squaresOf(planes[i], part);
  }
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (asked[i] == 0) continue;
    extents[i].across = std::sqrt(extents[i].across / planes[i].sums[kN]);
    extents[i].along = std::sqrt(std::max(0.0, moments[i].fit().eigenvalues[1]));
  }
  return extents;
}

/// Frees the pixels of planes whose direction noise leaves open.
void dropUncertain(std::vector<PlaneCandidate>& planes, PixelLabels& pixels,
                   const DisparityParams& params, PlaneSearchDiagnostics& diagnostics) {
  const double smooth = params.rough_fraction * params.camera.disparity_error;
  std::vector<char> rough(planes.size(), 0);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    rough[i] = planes[i].valid && planes[i].residual > smooth ? 1 : 0;
  }
  const std::vector<Extent> extents = extentsOf(planes, pixels.parts(), rough, params);
  const std::vector<PartList> lists = partsOfPlanes(pixels.parts(), planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    PlaneCandidate& plane = planes[i];
    if (!plane.valid) continue;
    const Matrix4 covariance = covarianceOf(plane, params);
    const double variance = covariance(0, 0) + covariance(1, 1) + covariance(2, 2);
    const bool thick =
        rough[i] != 0 && !(extents[i].across <= params.thick_fraction * extents[i].along);
    double most = thick ? params.max_thick_direction_error : params.max_direction_error;
    if (thick && variance > most * most &&
        isNoiseOfPlane(plane, pixels.parts(), lists[i], params)) {
      most = params.max_noisy_direction_error;
    }
    if (variance <= most * most) continue;
    plane.valid = false;
    ++diagnostics.rejected_not_significant;
  }
  freeInvalid(planes, pixels);
}

void describe(const PlaneCandidate& plane, const DisparityParams& params, PlaneSegment& segment) {
  segment.plane = {plane.direction, plane.height};
  segment.tilt = normalizedTilt(segment.plane);
  segment.covariance = covarianceOf(plane, params);
}

}  // namespace

PlaneSet findPlanesDisparity(const PointsView& points, const Indices* indices,
                             const MultiPlaneParams& params) {
  PlaneSet set;
  DisparityFit fit(DisparityParams(params, *params.noise));
  const TiledCloud cloud =
      tileCloud(points, indices, Vector3::Zero(), &*params.noise, params.threads);
  const CellGrid tiles = tileGrid(cloud, params.threads);
  const double finite = std::accumulate(tiles.moment(kN), tiles.moment(kN) + tiles.cells(), 0.0);
  set.diagnostics.points_not_measured = countOf(points, indices) - static_cast<std::size_t>(finite);
  if (!(finite > 0.0)) return set;

  DisparityGrower grower(tiles, fit);
  fit.setNoise(grower.noise());
  const DisparityParams& own = fit.params();
  std::vector<PlaneCandidate> planes;
  DisparityAssigner pixels(cloud, tiles, params.threads);
  const auto assignAndReject = [&] {
    pixels.assign(planes, own, own.growing_fraction, own.growing_factor);
    reject(planes, pixels, params.min_inliers * kMinSeedFraction, cloud, fit, true,
           set.diagnostics);
  };
  pixels.addCells(
      tiles, growPlanes(grower, tiles, fit, params.min_inliers, planes, pixels, set.diagnostics));
  assignAndReject();
  {
    const CellGrid quarters = freeQuarterGrid(cloud, pixels.labels(), params.threads);
    DisparityGrower of_quarters(quarters, fit);
    pixels.addCells(quarters, growPlanes(of_quarters, quarters, fit, params.min_inliers, planes,
                                         pixels, set.diagnostics));
  }
  assignAndReject();
  // The planes are final; what else lies within d_T of them where they are counts as theirs (Eq.
  // 11).
  pixels.assign(planes, own, 1.0, own.noise_factor);
  const std::vector<PlaneCandidate> fitted = planes;
  reject(planes, pixels, params.min_inliers, cloud, fit, false, set.diagnostics);
  dropUncertain(planes, pixels, own, set.diagnostics);

  const std::vector<PlaneSegment*> segments =
      makeSegments(points, cloud, pixels, params.patch_gap, planes, set);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (segments[i] == nullptr) continue;
    // Points far off in the band would pull the plane.
    const MomentSums sums = planes[i].sums;
    planes[i] = fitted[i];
    planes[i].residual = std::sqrt(planes[i].meanSquare(sums));
    planes[i].sums = sums;
    describe(planes[i], own, *segments[i]);
  }
  std::vector<double> squares(planes.size(), 0.0);
  for (const TilePart& part : pixels.parts()) {
    const auto i = static_cast<std::size_t>(part.label);
    segments[i]->moments.merge(onPlane(planes[i], part.sums, own));
    squares[i] += squaresOf(planes[i], part);
  }
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (segments[i] == nullptr) continue;
    PlaneSegment& segment = *segments[i];
    segment.rms = std::sqrt(squares[i] / planes[i].sums[kN]);
    // What the points lie off the plane.
    const Vector3& normal = segment.plane.normal;
    segment.moments =
        PlaneMoments::fromSums(segment.moments.weight(), Vector3::Zero(),
                               segment.moments.scatter() + squares[i] * normal * normal.transpose(),
                               segment.moments.mean());
  }
  return set;
}

}  // namespace planar_mapping::detail
