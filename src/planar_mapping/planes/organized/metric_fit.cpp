// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/organized/metric_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/simd.h"

namespace planar_mapping::detail {
namespace {

// Square roots that need not report errors are vectors like the rest.
#if defined(__GNUC__) && !defined(__clang__)
#define PLANAR_MAPPING_FREE_ROOTS __attribute__((optimize("no-math-errno,no-trapping-math")))
#else
#define PLANAR_MAPPING_FREE_ROOTS
#endif

constexpr std::size_t kBlock = 32;  ///< cells that are fitted together

/// What is left of a plane's normal where the rays run along it, squared.
constexpr double kGrazing = 1e-6;

// Least squares along the ray to the mean, whose direction is exact: the normal n minimises
// n^T C n for n . ray = 1, which makes it the adjugate of the covariance C times the ray. Least
// squares across the plane would lie any way where the noise is as large as the cell.
PLANAR_MAPPING_MULTIVERSION PLANAR_MAPPING_FREE_ROOTS void fitAll(const double* sums,
                                                                  std::size_t cells,
                                                                  const double* sensor,
                                                                  float* out) {
  constexpr int kFields = 9;
  static_assert(sizeof(CellFit) == kFields * sizeof(float), "CellFit is written as nine floats");
  float fields[kFields][kBlock];
  for (std::size_t begin = 0; begin < cells; begin += kBlock) {
    const std::size_t count = cells - begin < kBlock ? cells - begin : kBlock;
    const double* s = sums + begin;
    double points = 0.0;
    for (std::size_t i = 0; i < count; ++i) points += s[i];
    if (!(points > 0.0)) {
      for (std::size_t i = 0; i < count * kFields; ++i) out[begin * kFields + i] = 0.0F;
      continue;
    }
    for (std::size_t i = 0; i < count; ++i) {
      const double n = s[kN * cells + i];
      const double inverse = n > 2.5 ? 1.0 / n : 0.0;
      const double mx = s[kX * cells + i] * inverse;
      const double my = s[kY * cells + i] * inverse;
      const double mz = s[kZ * cells + i] * inverse;
      const double xx = s[kXX * cells + i] * inverse - mx * mx;
      const double yy = s[kYY * cells + i] * inverse - my * my;
      const double zz = s[kZZ * cells + i] * inverse - mz * mz;
      const double trace = xx + yy + zz;
      const double scale = trace > 1e-20 ? 1.0 / trace : 0.0;
      // Covariance divided by its trace, rows (a b c), (b d e), (c e f), and its adjugate.
      const double a = xx * scale;
      const double b = (s[kXY * cells + i] * inverse - mx * my) * scale;
      const double c = (s[kXZ * cells + i] * inverse - mx * mz) * scale;
      const double d = yy * scale;
      const double e = (s[kYZ * cells + i] * inverse - my * mz) * scale;
      const double f = zz * scale;
      const double aa = d * f - e * e;
      const double ab = c * e - b * f;
      const double ac = b * e - c * d;
      const double bb = a * f - c * c;
      const double bc = b * c - a * e;
      const double cc = a * d - b * b;
      const double rx = mx - sensor[0];
      const double ry = my - sensor[1];
      const double rz = mz - sensor[2];
      const double squared_range = rx * rx + ry * ry + rz * rz;
      const double to_unit = squared_range > 1e-20 ? 1.0 / __builtin_sqrt(squared_range) : 0.0;
      const double ux = rx * to_unit;
      const double uy = ry * to_unit;
      const double uz = rz * to_unit;
      double nx = aa * ux + ab * uy + ac * uz;
      double ny = ab * ux + bb * uy + bc * uz;
      double nz = ac * ux + bc * uy + cc * uz;
      double nn = nx * nx + ny * ny + nz * nz;
      // Where the rays run along the plane, the longest column is normal to it.
      const double a2 = aa * aa + ab * ab + ac * ac;
      const double b2 = ab * ab + bb * bb + bc * bc;
      const double c2 = ac * ac + bc * bc + cc * cc;
      const bool grazing = nn <= kGrazing * (a2 + b2 + c2);
      const bool second = b2 > a2 && b2 >= c2;
      const bool third = c2 > a2 && c2 > b2;
      nx = grazing ? (third ? ac : (second ? ab : aa)) : nx;
      ny = grazing ? (third ? bc : (second ? bb : ab)) : ny;
      nz = grazing ? (third ? cc : (second ? bc : ac)) : nz;
      nn = grazing ? (third ? c2 : (second ? b2 : a2)) : nn;
      // A point or a line has no plane: the adjugate vanishes.
      const double length = nn > 1e-14 ? 1.0 / __builtin_sqrt(nn) : 0.0;
      nx *= length;
      ny *= length;
      nz *= length;
      const double square =
          a * nx * nx + d * ny * ny + f * nz * nz + 2.0 * (b * nx * ny + c * nx * nz + e * ny * nz);
      const double across = square > 0.0 ? square : 0.0;
      // Without the noise along the rays the covariance is flat; its middle eigenvalue is left.
      const double cosine = nx * ux + ny * uy + nz * uz;
      const double along = grazing ? across : across / (cosine * cosine + 1e-12);
      const double in_rays =
          a * ux * ux + d * uy * uy + f * uz * uz + 2.0 * (b * ux * uy + c * ux * uz + e * uy * uz);
      const double rest = 1.0 - along;
      const double product = aa + bb + cc - along * (1.0 - in_rays);
      const double root = rest * rest - 4.0 * product;
      const double middle = 0.5 * (rest - __builtin_sqrt(root > 0.0 ? root : 0.0));
      const double size = trace > 0.0 ? trace : 0.0;
      fields[0][i] = static_cast<float>(nx);
      fields[1][i] = static_cast<float>(ny);
      fields[2][i] = static_cast<float>(nz);
      fields[3][i] = static_cast<float>(mx);
      fields[4][i] = static_cast<float>(my);
      fields[5][i] = static_cast<float>(mz);
      fields[6][i] = static_cast<float>(__builtin_sqrt(across * size));
      fields[7][i] = static_cast<float>(__builtin_sqrt((middle > 0.0 ? middle : 0.0) * size));
      fields[8][i] = static_cast<float>(n);
    }
    for (std::size_t i = 0; i < count; ++i) {
      for (int field = 0; field < kFields; ++field) {
        out[(begin + i) * kFields + static_cast<std::size_t>(field)] = fields[field][i];
      }
    }
  }
}

struct NoiseSample {
  double squared_range;
  double noise;
};

std::vector<NoiseSample> noiseSamples(const CellFits& windows, double min_count,
                                      const Vector3& sensor) {
  constexpr double kMinCosine = 0.2;  // more oblique windows tell little about the range
  std::vector<NoiseSample> samples;
  for (const CellFit& fit : windows) {
    if (fit.count < min_count) continue;
    const double squared_range = fit.squaredRange(sensor);
    const double along = fit.height(sensor);
    if (!(along * along > kMinCosine * kMinCosine * squared_range)) continue;
    const double deviation = fit.residual * std::sqrt(squared_range) / along;
    if (std::isfinite(deviation)) samples.push_back({squared_range, deviation});
  }
  return samples;
}

/// \param capacity points of a full window
RangeNoise noiseOf(const CellFits& windows, int capacity, const Vector3& sensor,
                   const OrganizedParams& params) {
  constexpr double kFull = 0.8;    // fraction of a window; emptier ones lie at depth edges
  constexpr double kSparse = 0.3;  // enough where the whole image is sparse
  constexpr std::size_t kBins = 8;
  constexpr std::size_t kMinSamples = 4 * kBins;
  std::vector<NoiseSample> samples = noiseSamples(windows, kFull * capacity, sensor);
  if (samples.size() < kMinSamples) samples = noiseSamples(windows, kSparse * capacity, sensor);
  RangeNoise noise;
  if (samples.size() < kBins) {
    noise.constant = params.flatDistance();
    return noise;
  }
  std::sort(samples.begin(), samples.end(), [](const NoiseSample& a, const NoiseSample& b) {
    return a.squared_range < b.squared_range;
  });
  // Weighted least squares of quantile = constant + quadratic r^2 over bins of equal count.
  double w = 0.0, wx = 0.0, wxx = 0.0, wy = 0.0, wxy = 0.0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const auto begin = samples.begin() + static_cast<std::ptrdiff_t>(bin * samples.size() / kBins);
    const auto end =
        samples.begin() + static_cast<std::ptrdiff_t>((bin + 1) * samples.size() / kBins);
    const double squared_range = (begin + (end - begin) / 2)->squared_range;
    const auto at = begin + static_cast<std::ptrdiff_t>(params.noise_quantile *
                                                        static_cast<double>(end - begin));
    std::nth_element(begin, at, end,
                     [](const NoiseSample& a, const NoiseSample& b) { return a.noise < b.noise; });
    const double weight = 1.0 / std::max(at->noise * at->noise, 1e-12);
    w += weight;
    wx += weight * squared_range;
    wxx += weight * squared_range * squared_range;
    wy += weight * at->noise;
    wxy += weight * squared_range * at->noise;
  }
  const double determinant = w * wxx - wx * wx;
  if (determinant > 1e-9 * w * wxx) {
    noise.constant = (wxx * wy - wx * wxy) / determinant;
    noise.quadratic = (w * wxy - wx * wy) / determinant;
  }
  if (!(noise.constant >= 0.0) || !(noise.quadratic > 0.0)) {
    const bool falls = noise.quadratic < 0.0 || !(determinant > 1e-9 * w * wxx);
    noise.constant = falls ? wy / w : 0.0;
    noise.quadratic = falls ? 0.0 : wxy / wxx;
  }
  // More than half of d_T is scatter, no surface.
  noise.constant = std::min(noise.constant, 0.5 * params.distance_threshold);
  noise.quadratic = std::min(noise.quadratic, params.max_quadratic_noise);
  return noise;
}

/// Pixels that count as one measurement: how far the means of cells lie off the plane of the 3 x 3
/// window around them, compared with the noise of single pixels.
double correlatedPixels(const CellGrid& grid, const CellFits& windows, const RangeNoise& noise,
                        const Vector3& sensor, const OrganizedParams& params) {
  constexpr double kFull = 0.95;    // fraction of a window
  constexpr double kFlat = 1.3;     // residual over noise
  constexpr int kStep = 2;          // windows overlap: every other one tells enough
  constexpr double kFreedom = 6.0;  // of nine means about their plane
  constexpr std::size_t kMinSamples = 16;
  std::vector<double> samples;
  for (int row = 1; row + 1 < grid.rows; row += kStep) {
    for (int column = 1; column + 1 < grid.columns; column += kStep) {
      const CellFit& fit = windows[static_cast<std::size_t>(row) * grid.columns + column];
      if (fit.count < kFull * 9.0 * grid.capacity || !(fit.residual > 0.0F)) continue;
      const double squared_range = fit.squaredRange(sensor);
      if (fit.residual * std::sqrt(squared_range) >
          kFlat * fit.height(sensor) * noise.at(squared_range)) {
        continue;
      }
      double squares = 0.0;
      for (int r = row - 1; r <= row + 1; ++r) {
        for (int c = column - 1; c <= column + 1; ++c) {
          const Vector3 mean = meanOf(grid, r * grid.columns + c);
          const double off = fit.normal[0] * (mean[0] - fit.mean[0]) +
                             fit.normal[1] * (mean[1] - fit.mean[1]) +
                             fit.normal[2] * (mean[2] - fit.mean[2]);
          squares += off * off;
        }
      }
      const double residual = fit.residual;
      samples.push_back(grid.capacity * squares / kFreedom / (residual * residual));
    }
  }
  if (samples.size() < kMinSamples) return RangeNoise().correlated_pixels;
  const double place = params.noise_quantile * static_cast<double>(samples.size());
  return std::min(std::max(1.0, ranked(samples, static_cast<std::size_t>(place))),
                  static_cast<double>(grid.capacity));
}

}  // namespace

CellFits fitCells(const CellGrid& grid, const Vector3& sensor) {
  CellFits fits(static_cast<std::size_t>(grid.cells()));
  if (!fits.empty()) fitAll(grid.sums.data(), fits.size(), sensor.data(), fits.front().normal);
  return fits;
}

RangeNoise estimateNoise(const CellGrid& tiles, const CellFits& fits, const CellFits& windows,
                         const Vector3& sensor, const OrganizedParams& params) {
  constexpr int kWindowCells = 9;
  // Small windows tell white noise best, wide ones that which is smooth over many pixels.
  RangeNoise white = noiseOf(fits, tiles.capacity, sensor, params);
  white.correlated_pixels = correlatedPixels(tiles, windows, white, sensor, params);
  if (white.correlated_pixels <= params.white_correlation) return white;
  RangeNoise noise = noiseOf(windows, kWindowCells * tiles.capacity, sensor, params);
  noise.correlated_pixels = correlatedPixels(tiles, windows, noise, sensor, params);
  return noise;
}

double normalError(const CellFit& fit, const RangeNoise& noise, const Vector3& sensor,
                   const OrganizedParams& params) {
  const double squared_range = fit.squaredRange(sensor);
  const double expected = noise.at(squared_range) * fit.height(sensor) / std::sqrt(squared_range);
  const double sigma = std::min(expected, static_cast<double>(fit.residual));
  const double correlated = noise.correlated_pixels <= params.white_correlation
                                ? noise.correlated_pixels
                                : kCorrelatedPixels;
  const double independent = std::max(1.0, fit.count / correlated);
  const double error = sigma / (fit.extent * std::sqrt(independent));
  return std::isfinite(error) ? error : M_PI_2;
}

void MetricFit::fit(PlaneCandidate& plane) const {
  CellFit found;
  fitAll(plane.sums.data(), 1, sensor_.data(), found.normal);
  const Vector3 n(found.normal[0], found.normal[1], found.normal[2]);
  const double length = n.norm();
  plane.valid = length > 0.5 && found.extent > 0.0F && std::isfinite(length);
  if (!plane.valid) return;
  const MomentSums& sums = plane.sums;
  plane.direction = plane.normal = n / length;
  plane.offset =
      -(plane.normal[0] * sums[kX] + plane.normal[1] * sums[kY] + plane.normal[2] * sums[kZ]) /
      sums[kN];
  plane.height = plane.distance(sensor_);
  plane.residual = found.residual;
  plane.width = found.extent;
}

void MetricFit::refine(PlaneCandidate& plane, const std::vector<TilePart>& parts,
                       const PartList& list) const {
  if (!plane.valid || list.size() < 3) return;
  Matrix3 squares = Matrix3::Zero();
  Vector3 products = Vector3::Zero();
  double mean_range = 0.0;
  for (const std::size_t index : list) {
    const MomentSums& sums = parts[index].sums;
    const double n = sums[kN];
    const Vector3 ray = meanOf(sums) - sensor_;
    const double range = ray.norm();
    if (!(range > 0.0)) return;
    mean_range += n * range;
    // Error of 1 / r; a floor keeps the weights of noise-free clouds finite.
    const double sigma =
        noise_.at(range * range) + params_.smallest_noise_fraction * params_.distance_threshold;
    const double error = sigma / (range * range);
    const double weight = n / (error * error);
    const Vector3 direction = ray / range;
    squares += weight * direction * direction.transpose();
    products += weight / range * direction;
  }
  mean_range /= plane.sums[kN];
  if (std::fabs(plane.height) < params_.min_ray_sine * mean_range) return;
  // m . direction = 1 / r describes the plane m . (p - sensor) = 1.
  const Vector3 m = squares.ldlt().solve(products);
  const double length = m.norm();
  if (!m.allFinite() || !(length > 0.0)) return;
  PlaneCandidate along = plane;
  const double sign = plane.height > 0.0 ? -1.0 : 1.0;
  along.direction = along.normal = sign * m / length;
  along.offset = sign * (-1.0 / length - m.dot(sensor_) / length);
  along.height = along.distance(sensor_);
  along.residual = std::sqrt(along.meanSquare(plane.sums));
  if (along.residual <= params_.max_residual_growth * plane.residual) plane = along;
}

bool MetricFit::areOne(const PlaneCandidate& one, const PlaneCandidate& other, bool adjacent,
                       PlaneCandidate& joined) const {
  if (one.cosine(other.direction) < std::cos(2.0 * params_.merging_angle)) return false;
  joined.sums = one.sums;
  addSums(joined.sums, other.sums);
  fit(joined);
  if (!joined.valid) return false;
  // Noise and dents part what touches; what does not must be as flat together as surfaces are.
  const double flat = adjacent ? params_.touchingDistance() : params_.flatDistance();
  for (const PlaneCandidate* part : {&one, &other}) {
    if (joined.cosine(part->direction) < std::cos(params_.merging_angle)) return false;
    const double sigma = noise_.at((meanOf(part->sums) - sensor_).squaredNorm());
    const double allowed = std::max(flat, 0.5 * sigma);
    const double excess = joined.meanSquare(part->sums) - part->residual * part->residual;
    if (!(excess < allowed * allowed)) return false;
  }
  return true;
}

CoherenceTest MetricFit::coherenceTest(const PlaneCandidate& plane,
                                       const std::vector<TilePart>& /*parts*/,
                                       const PartList& /*list*/) const {
  CoherenceTest test;
  if (plane.width >= params_.straight_flatness * plane.residual) return test;
  if (plane.width < params_.clear_flatness * plane.residual) {
    test.min_agreement = params_.min_agreement;
  }
  test.may_bend = false;
  test.axes[0] = plane.normal.unitOrthogonal();
  test.axes[1] = plane.normal.cross(test.axes[0]);
  return test;
}

std::vector<char> MetricFit::agree(const PlaneCandidate& plane, const CellGrid& windows) const {
  const CellFits fits = fitCells(windows, sensor_);
  std::vector<char> agrees(fits.size());
  for (std::size_t i = 0; i < fits.size(); ++i) {
    const double error = params_.growing_factor * normalError(fits[i], noise_, sensor_, params_);
    const double allowed =
        std::min(params_.most_coherent_angle, std::max(params_.coherent_angle, error));
    agrees[i] = plane.cosine(fits[i].normal) >= std::cos(allowed);
  }
  return agrees;
}

bool MetricFit::isBent(const PlaneCandidate& plane, const Bend& bend) const {
  if (!(std::atan(bend.slope) > params_.bent_angle) || !(bend.advantage > params_.bent_advantage)) {
    return false;
  }
  const Vector3 ray = meanOf(plane.sums) - sensor_;
  const double along = std::fabs(plane.height) / std::max(ray.norm(), 1e-9);
  const double of_tile = std::sqrt(std::min(1.0, noise_.correlated_pixels / kTileArea));
  return bend.bow > std::max(params_.bow_fraction * params_.distance_threshold,
                             noise_.at(ray.squaredNorm()) * along * of_tile);
}

}  // namespace planar_mapping::detail
