// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/disparity/disparity_fit.h"

namespace planar_mapping::detail {

DisparityWindow fitDisparity(const MomentSums& s) {
  constexpr double kFewest = 3.0;
  constexpr double kThinnest = 1e-6;  // of the extents' squares
  DisparityWindow fit;
  const double n = s[kN];
  if (!(n >= kFewest)) return fit;
  const double inverse = 1.0 / n;
  const double mx = s[kX] * inverse;
  const double my = s[kY] * inverse;
  const double md = s[kZ] * inverse;
  const double xx = s[kXX] * inverse - mx * mx;
  const double xy = s[kXY] * inverse - mx * my;
  const double yy = s[kYY] * inverse - my * my;
  const double xd = s[kXZ] * inverse - mx * md;
  const double yd = s[kYZ] * inverse - my * md;
  const double dd = s[kZZ] * inverse - md * md;
  const double determinant = xx * yy - xy * xy;
  const double trace = xx + yy;
  if (!(determinant > kThinnest * trace * trace) || !(trace > 0.0)) return fit;
  const double larger = 0.5 * (trace + std::sqrt((xx - yy) * (xx - yy) + 4.0 * xy * xy));
  fit.p = (yy * xd - xy * yd) / determinant;
  fit.q = (xx * yd - xy * xd) / determinant;
  fit.x = mx;
  fit.y = my;
  fit.d = md;
  fit.residual = std::sqrt(std::max(0.0, dd - fit.p * xd - fit.q * yd));
  fit.extent = std::sqrt(determinant / larger);
  fit.count = n;
  return fit;
}

std::vector<DisparityWindow> fitDisparities(const CellGrid& grid) {
  std::vector<DisparityWindow> fits(static_cast<std::size_t>(grid.cells()));
  for (int cell = 0; cell < grid.cells(); ++cell) {
    if (grid.count(cell) > 0.0)
      fits[static_cast<std::size_t>(cell)] = fitDisparity(sumsOf(grid, cell));
  }
  return fits;
}

void DisparityFit::toMetres(double p, double q, double r, Vector3& normal, double& height) const {
  // D z = B f, so p f x + q f y + r z = B f.
  const Vector3 m(p * params_.camera.focal_length, q * params_.camera.focal_length, r);
  const double length = std::sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
  normal = -m / length;
  height = params_.factor() / length;
}

double DisparityFit::toAngle(double slope, double height, double x, double y, double d) const {
  // A slope turns the plane by h cos / B.
  const double f = params_.camera.focal_length;
  const double range = params_.factor() / d * std::sqrt(1.0 + (x * x + y * y) / (f * f));
  return slope * height * std::min(1.0, height / range) / params_.camera.baseline;
}

void DisparityFit::fit(PlaneCandidate& plane) const {
  const DisparityWindow found = fitDisparity(plane.sums);
  plane.valid = found.count > 0.0 && std::isfinite(found.p) && std::isfinite(found.q);
  if (!plane.valid) return;
  plane.normal = {found.p, found.q, -1.0};
  plane.offset = found.d - found.p * found.x - found.q * found.y;
  plane.residual = found.residual;
  plane.width = found.extent;
  toMetres(plane.normal[0], plane.normal[1], plane.offset, plane.direction, plane.height);
  plane.valid = std::isfinite(plane.height) && plane.height > 0.0;
}

bool DisparityFit::areOne(const PlaneCandidate& one, const PlaneCandidate& other, bool adjacent,
                          PlaneCandidate& joined) const {
  joined.sums = one.sums;
  addSums(joined.sums, other.sums);
  fit(joined);
  if (!joined.valid) return false;
  const double flat = params_.touchingDistance();
  const double noise_factor = adjacent ? 1.0 : params_.merging_apart_factor;
  for (const PlaneCandidate* part : {&one, &other}) {
    const double n = part->sums[kN];
    const double turn =
        std::hypot(joined.normal[0] - part->normal[0], joined.normal[1] - part->normal[1]);
    // Where they touch as far as the noise lets one see.
    if (joined.cosine(part->direction) < std::cos(params_.merging_angle) &&
        !(adjacent && turn <= params_.growing_factor * params_.slopeError(part->width, n))) {
      return false;
    }
    const double allowed =
        std::max(toPixels(joined, flat, part->sums[kZ] / n), noise_factor * params_.tolerance(1.0));
    const double excess = joined.meanSquare(part->sums) - part->residual * part->residual;
    if (!(excess < allowed * allowed)) return false;
  }
  return true;
}

bool DisparityFit::isNoiseWhite(const PlaneCandidate& plane, const std::vector<TilePart>& parts,
                                const PartList& list) const {
  constexpr double kFullTile = 0.75 * kTileArea;
  constexpr double kMinFraction = 0.5;
  constexpr double kMinTiles = 20.0;
  constexpr double kWhite = 0.35;  // of the residual: means of tiles that differ by white noise
  double squares = 0.0;
  double weights = 0.0;
  for (const std::size_t i : list) {
    if (parts[i].sums[kN] < kFullTile) continue;
    const double error = plane.meanError(parts[i].sums);
    squares += parts[i].sums[kN] * error * error;
    weights += parts[i].sums[kN];
  }
  const double smooth = kWhite * plane.residual;
  return weights >= kMinFraction * plane.sums[kN] && weights >= kMinTiles * kTileArea &&
         squares <= weights * smooth * smooth;
}

CoherenceTest DisparityFit::coherenceTest(const PlaneCandidate& plane,
                                          const std::vector<TilePart>& parts,
                                          const PartList& list) const {
  const double d = plane.sums[kZ] / plane.sums[kN];
  const bool flat = plane.residual <= toPixels(plane, params_.flatDistance(), d);
  CoherenceTest test;
  test.min_agreement = flat ? params_.min_flat_agreement : params_.min_agreement;
  // Where such planes meet, noise mixes their pixels, which says nothing against either.
  test.own_points_only = isNoiseWhite(plane, parts, list);
  return test;
}

std::vector<char> DisparityFit::agree(const PlaneCandidate& plane, const CellGrid& windows) const {
  const std::vector<DisparityWindow> fits = fitDisparities(windows);
  const double min_cosine = std::cos(params_.coherent_angle);
  std::vector<char> agrees(fits.size(), 0);
  for (std::size_t i = 0; i < fits.size(); ++i) {
    const DisparityWindow& fit = fits[i];
    if (!(fit.count > 0.0)) continue;
    Vector3 normal;
    double height = 0.0;
    toMetres(fit.p, fit.q, fit.d - fit.p * fit.x - fit.q * fit.y, normal, height);
    const double turn = std::hypot(fit.p - plane.normal[0], fit.q - plane.normal[1]);
    agrees[i] = plane.cosine(normal) >= min_cosine ||
                turn <= params_.growing_factor * params_.slopeError(fit.extent, fit.count);
  }
  return agrees;
}

}  // namespace planar_mapping::detail
