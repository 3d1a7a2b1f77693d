// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "planes/disparity/disparity_assignment.h"
#include "planes/disparity/disparity_coherence.h"
#include "planes/disparity/disparity_doubt.h"
#include "planes/disparity/disparity_growing.h"
#include "planes/organized/organized_segments.h"
#include "planes/plane_search.h"

namespace planar_mapping::detail {
namespace {

std::vector<std::int16_t> renamed(const std::vector<std::int16_t>& labels,
                                  const std::vector<std::int16_t>& target) {
  std::vector<std::int16_t> result(labels.size(), -1);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] >= 0) result[i] = target[static_cast<std::size_t>(labels[i])];
  }
  return result;
}

/// The plane of each quarter: the one grown there, else that of a pixel near its middle.
std::vector<std::int16_t> labelsOfQuarters(const std::vector<std::int16_t>& pixels,
                                           const std::vector<std::int16_t>& grown,
                                           const TiledCloud& cloud) {
  std::vector<std::int16_t> labels(grown);
  std::size_t i = 0;
  for (int row = 0; row < 2 * cloud.rows; ++row) {
    for (int column = 0; column < 2 * cloud.columns; ++column, ++i) {
      if (labels[i] >= 0) continue;
      const auto tile = static_cast<std::size_t>(row / 2 * cloud.columns + column / 2);
      const int middle = pixelInTile(row % 2 * kQuarterSide + kQuarterSide / 2,
                                     column % 2 * kQuarterSide + kQuarterSide / 2);
      labels[i] = pixels[tile * kTileArea + static_cast<std::size_t>(middle)];
    }
  }
  return labels;
}

/// Sums and planes from the pixels they hold.
void refit(std::vector<DisparityPlane>& planes, const std::vector<TilePart>& parts,
           const DisparityParams& params) {
  for (DisparityPlane& plane : planes) plane.sums = {};
  for (const TilePart& part : parts) {
    addSums(planes[static_cast<std::size_t>(part.label)].sums, part.sums);
  }
  for (DisparityPlane& plane : planes) {
    if (plane.valid) plane.fit(params);
  }
}

/// Refits planes to their pixels and frees those of planes that are too small or, if \p doubt, not
/// coherent.
void drop(std::vector<DisparityPlane>& planes, DisparityAssigner& pixels, double min_points,
          const TiledCloud& cloud, const DisparityParams& params, bool doubt,
          PlaneSearchDiagnostics& diagnostics) {
  std::vector<char> stood(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) stood[i] = planes[i].valid ? 1 : 0;
  refit(planes, pixels.parts(), params);
  const std::vector<char> coherent =
      doubt ? coherentDisparities(planes, pixels.parts(), cloud.columns, cloud.tiles(), params)
            : std::vector<char>(planes.size(), 1);
  std::vector<std::int16_t> target(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    target[i] = static_cast<std::int16_t>(i);
    if (stood[i] != 0 && (!planes[i].valid || planes[i].sums[kN] < min_points)) {
      ++diagnostics.rejected_too_small;
      planes[i].valid = false;
    } else if (stood[i] != 0 && coherent[i] == 0) {
      ++diagnostics.rejected_not_coherent;
      planes[i].valid = false;
    }
    if (!planes[i].valid) target[i] = -1;
  }
  pixels.relabel(target);
}

/// Moments in metres of the points of a part, carried along their rays onto the plane.
PlaneMoments onPlane(const DisparityPlane& plane, const MomentSums& sums,
                     const DisparityParams& params) {
  const double n = sums[kN];
  const double f = params.camera.focal_length;
  const double x = sums[kX] / n;
  const double y = sums[kY] / n;
  // P = (X, Y, f) B / D with D = p X + q Y + r, and its derivatives by X and Y.
  const double d = plane.p * x + plane.q * y + plane.r;
  const double scale = params.camera.baseline / d;
  const Vector3 ray(x, y, f);
  const Vector3 by_x = scale * (Vector3::UnitX() - plane.p / d * ray);
  const Vector3 by_y = scale * (Vector3::UnitY() - plane.q / d * ray);
  const double xx = sums[kXX] - n * x * x;
  const double xy = sums[kXY] - n * x * y;
  const double yy = sums[kYY] - n * y * y;
  const Matrix3 outer = xx * by_x * by_x.transpose() + yy * by_y * by_y.transpose() +
                        xy * (by_x * by_y.transpose() + by_y * by_x.transpose());
  return PlaneMoments::fromSums(n, Vector3::Zero(), outer, scale * ray);
}

/// Sum of the squared distances of the points of a part from the plane, square metres.
double squaresOf(const DisparityPlane& plane, const TilePart& part) {
  const double metres = plane.height * part.sums[kN] / part.sums[kZ];
  return part.sums[kN] * plane.meanSquare(part.sums) * metres * metres;
}

/// Covariance of (a, b, c, d) from that of the regression.
Matrix4 covarianceOf(const DisparityPlane& plane, const DisparityParams& params) {
  const MomentSums& s = plane.sums;
  Matrix3 squares;
  squares << s[kXX], s[kXY], s[kX], s[kXY], s[kYY], s[kY], s[kX], s[kY], s[kN];
  const double variance = plane.residual * plane.residual * std::max(1.0, params.correlated_pixels);
  const Matrix3 of_slopes = variance * squares.inverse();
  // (a, b, c, d) = (-m, B f) / |m| with m = (p f, q f, r), turned towards the sensor.
  const double f = params.camera.focal_length;
  const Vector3 m(plane.p * f, plane.q * f, plane.r);
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
std::vector<Extent> extentsOf(const std::vector<DisparityPlane>& planes,
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
void dropUncertain(std::vector<DisparityPlane>& planes, DisparityAssigner& pixels,
                   const TiledCloud& cloud, const DisparityParams& params,
                   PlaneSearchDiagnostics& diagnostics) {
  const double smooth = params.rough_share * params.camera.disparity_error;
  std::vector<char> rough(planes.size(), 0);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    rough[i] = planes[i].valid && planes[i].residual > smooth ? 1 : 0;
  }
  const std::vector<Extent> extents = extentsOf(planes, pixels.parts(), rough, params);
  const std::vector<PartList> lists = partsOfPlanes(pixels.parts(), planes.size());
  std::vector<std::int16_t> target(planes.size(), -1);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    DisparityPlane& plane = planes[i];
    if (!plane.valid) continue;
    const Matrix4 covariance = covarianceOf(plane, params);
    const double variance = covariance(0, 0) + covariance(1, 1) + covariance(2, 2);
    const bool thick =
        rough[i] != 0 && !(extents[i].across <= params.thick_share * extents[i].along);
    double most = thick ? params.max_thick_direction_error : params.max_direction_error;
    if (thick && variance > most * most &&
        isNoiseOfPlane(plane, pixels.parts(), lists[i], cloud, pixels.labels(), params)) {
      most = params.max_noisy_direction_error;
    }
    if (variance <= most * most) {
      target[i] = static_cast<std::int16_t>(i);
    } else {
      plane.valid = false;
      ++diagnostics.rejected_not_significant;
    }
  }
  pixels.relabel(target);
}

void describe(const DisparityPlane& plane, const DisparityParams& params, PlaneSegment& segment) {
  segment.plane = {Vector3(plane.normal[0], plane.normal[1], plane.normal[2]), plane.height};
  segment.tilt = normalizedTilt(segment.plane);
  segment.covariance = covarianceOf(plane, params);
}

}  // namespace

PlaneSet findPlanesDisparity(const PointsView& points, const Indices* indices,
                             const MultiPlaneParams& params) {
  PlaneSet set;
  set.diagnostics.method = PlaneSearchMethod::Disparity;
  set.diagnostics.points_considered = indices != nullptr ? indices->size() : points.size;
  DisparityParams own(params, *params.noise);
  const TiledCloud cloud = tileDisparities(points, indices, own.camera, params.threads);
  const CellGrid tiles = tileGrid(cloud, params.threads);
  const double finite = std::accumulate(tiles.moment(kN), tiles.moment(kN) + tiles.cells(), 0.0);
  set.diagnostics.points_not_finite =
      set.diagnostics.points_considered - static_cast<std::size_t>(finite);
  if (!(finite > 0.0)) return set;

  std::vector<DisparityPlane> planes;
  DisparityAssigner pixels(cloud);
  const double tight_factor = own.growing_factor;
  const auto count = [&](const DisparityRegions& grown) {
    set.diagnostics.hypotheses += grown.seeds;
    set.diagnostics.rejected_too_small += grown.too_small;
  };
  {
    DisparityGrower grower(tiles, cloud.room[1]);
    own.noise = grower.estimateNoise(own);
    const DisparityRegions grown = grower.grow(own, planes);
    count(grown);
    const PlanePairs adjacent = adjacentPlanes(grown.labels, tiles.columns, tiles.rows);
    const std::vector<std::int16_t> target = mergePlanes(planes, adjacent, own);
    pixels.addCells(tiles, renamed(grown.labels, target));
    for (std::size_t i = 0; i < planes.size(); ++i) {
      planes[i].valid = planes[i].valid && target[i] == static_cast<std::int16_t>(i);
    }
  }
  pixels.assign(planes, own, own.growing_share, tight_factor, params.threads);
  drop(planes, pixels, own.min_inliers * own.min_seed_share, cloud, own, true, set.diagnostics);
  {
    const CellGrid quarters = freeQuarterGrid(cloud, pixels.labels(), params.threads);
    DisparityGrower grower(quarters, cloud.room[1]);
    const DisparityRegions grown = grower.grow(own, planes);
    count(grown);
    const PlanePairs adjacent = adjacentPlanes(
        labelsOfQuarters(pixels.labels(), grown.labels, cloud), quarters.columns, quarters.rows);
    const std::vector<std::int16_t> target = mergePlanes(planes, adjacent, own);
    pixels.relabel(target);
    pixels.addCells(quarters, renamed(grown.labels, target));
    for (std::size_t i = 0; i < planes.size(); ++i) {
      planes[i].valid = planes[i].valid && target[i] == static_cast<std::int16_t>(i);
    }
  }
  pixels.assign(planes, own, own.growing_share, tight_factor, params.threads);
  drop(planes, pixels, own.min_inliers * own.min_seed_share, cloud, own, true, set.diagnostics);
  // The planes stand; what else lies within d_T of them where they are counts as theirs (Eq. 11).
  pixels.assign(planes, own, 1.0, own.noise_factor, params.threads);
  std::vector<DisparityPlane> fitted = planes;
  drop(planes, pixels, own.min_inliers, cloud, own, false, set.diagnostics);
  dropUncertain(planes, pixels, cloud, own, set.diagnostics);

  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (planes[i].valid) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return planes[a].sums[kN] > planes[b].sums[kN];
  });
  set.planes.resize(order.size());
  std::vector<PlaneSegment*> segments(planes.size(), nullptr);
  for (std::size_t k = 0; k < order.size(); ++k) segments[order[k]] = &set.planes[k];
  for (const std::size_t i : order) {
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
  for (const std::size_t i : order) {
    PlaneSegment& segment = *segments[i];
    segment.rms = std::sqrt(squares[i] / planes[i].sums[kN]);
    // What the points lie off the plane.
    const Vector3& normal = segment.plane.normal;
    segment.moments =
        PlaneMoments::fromSums(segment.moments.weight(), Vector3::Zero(),
                               segment.moments.scatter() + squares[i] * normal * normal.transpose(),
                               segment.moments.mean());
  }
  listSegments(points, cloud, pixels.labels(), pixels.parts(), params.patch_gap, segments);
  return set;
}

}  // namespace planar_mapping::detail
