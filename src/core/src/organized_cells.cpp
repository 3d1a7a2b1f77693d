// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "organized_cells.h"

#include <algorithm>
#include <cmath>

#include "organized_lanes.h"
#include "planar_mapping/core/parallel.h"
#include "planar_mapping/core/simd.h"

namespace planar_mapping::detail {
namespace {

PLANAR_MAPPING_MULTIVERSION
void sumRows(const double* in, int columns, int rows, int radius, double* out) {
  for (int row = 0; row < rows; ++row) {
    const int from = row - radius > 0 ? row - radius : 0;
    const int to = row + radius < rows - 1 ? row + radius : rows - 1;
    double* line = out + static_cast<std::size_t>(row) * columns;
    const double* first = in + static_cast<std::size_t>(from) * columns;
    for (int column = 0; column < columns; ++column) line[column] = first[column];
    for (int other = from + 1; other <= to; ++other) {
      const double* add = in + static_cast<std::size_t>(other) * columns;
      for (int column = 0; column < columns; ++column) line[column] += add[column];
    }
  }
}

PLANAR_MAPPING_MULTIVERSION
void sumColumns(double* data, int columns, int rows, int radius, double* padded) {
  // padded: columns + 2 * radius values, zero at both ends.
  for (int row = 0; row < rows; ++row) {
    double* line = data + static_cast<std::size_t>(row) * columns;
    for (int column = 0; column < columns; ++column) padded[radius + column] = line[column];
    for (int column = 0; column < columns; ++column) line[column] = padded[column];
    for (int shift = 1; shift <= 2 * radius; ++shift) {
      for (int column = 0; column < columns; ++column) line[column] += padded[column + shift];
    }
  }
}

constexpr std::size_t kBlock = 32;  ///< cells that are fitted together

/// Covariances of a block of cells divided by their traces: rows (a b c), (b d e), (c e f).
struct CovarianceBlock {
  double a[kBlock], b[kBlock], c[kBlock], d[kBlock], e[kBlock], f[kBlock];
  double c1[kBlock], c0[kBlock];  ///< of the characteristic polynomial
  double root[kBlock];            ///< smallest eigenvalue
  float trace[kBlock];            ///< square metres
};

/// Smallest eigenvalues by Newton's method from below, where the characteristic polynomial is
/// monotonic and convex: in single precision, which is a fraction of the work, then polished.
PLANAR_MAPPING_INLINE void findRoots(CovarianceBlock& block, std::size_t count) {
  constexpr int kSteps = 7;
  constexpr int kPolishingSteps = 2;
  const FloatLanes zero = {};
  for (std::size_t i = count; i % kLanes != 0; ++i) block.c1[i] = block.c0[i] = 0.0;
  for (std::size_t i = 0; i < count; i += kLanes) {
    float c1_values[kLanes];
    float c0_values[kLanes];
    for (std::size_t k = 0; k < kLanes; ++k) c1_values[k] = static_cast<float>(block.c1[i + k]);
    for (std::size_t k = 0; k < kLanes; ++k) c0_values[k] = static_cast<float>(block.c0[i + k]);
    FloatLanes c1, c0;
    load(c1_values, c1);
    load(c0_values, c0);
    FloatLanes root = zero;
    for (int step = 0; step < kSteps; ++step) {
      const FloatLanes value = ((root - 1.0F) * root + c1) * root - c0;
      const FloatLanes slope = (3.0F * root - 2.0F) * root + c1;
      root -= slope > 1e-12F ? value / slope : zero;
    }
    for (std::size_t k = 0; k < kLanes; ++k) block.root[i + k] = root[k];
  }
  for (std::size_t i = 0; i < count; ++i) {
    const double c1 = block.c1[i];
    double root = block.root[i];
    for (int step = 0; step < kPolishingSteps; ++step) {
      const double value = ((root - 1.0) * root + c1) * root - block.c0[i];
      const double slope = (3.0 * root - 2.0) * root + c1;
      root -= slope > 1e-12 ? value / slope : 0.0;
    }
    block.root[i] = root;
  }
}

// The normal is a cross product of two rows of the covariance less its smallest eigenvalue.
PLANAR_MAPPING_MULTIVERSION
void fitAll(const double* sums, std::size_t cells, float* out) {
  constexpr int kFields = 9;
  static_assert(sizeof(CellFit) == kFields * sizeof(float), "CellFit is written as nine floats");
  float fields[kFields][kBlock];
  CovarianceBlock block;
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
      const double a = xx * scale;
      const double b = (s[kXY * cells + i] * inverse - mx * my) * scale;
      const double c = (s[kXZ * cells + i] * inverse - mx * mz) * scale;
      const double d = yy * scale;
      const double e = (s[kYZ * cells + i] * inverse - my * mz) * scale;
      const double f = zz * scale;
      block.a[i] = a;
      block.b[i] = b;
      block.c[i] = c;
      block.d[i] = d;
      block.e[i] = e;
      block.f[i] = f;
      block.c1[i] = a * d - b * b + a * f - c * c + d * f - e * e;
      block.c0[i] = a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d);
      block.trace[i] = static_cast<float>(trace > 0.0 ? trace : 0.0);
      fields[3][i] = static_cast<float>(mx);
      fields[4][i] = static_cast<float>(my);
      fields[5][i] = static_cast<float>(mz);
      fields[8][i] = static_cast<float>(n);
    }
    findRoots(block, count);
    for (std::size_t i = 0; i < count; ++i) {
      const double root = block.root[i] > 0.0 ? block.root[i] : 0.0;
      const double b = block.b[i];
      const double c = block.c[i];
      const double e = block.e[i];
      const double ar = block.a[i] - root;
      const double dr = block.d[i] - root;
      const double fr = block.f[i] - root;
      const double ux = b * e - c * dr;
      const double uy = c * b - ar * e;
      const double uz = ar * dr - b * b;
      const double vx = b * fr - c * e;
      const double vy = c * c - ar * fr;
      const double vz = ar * e - b * c;
      const double wx = dr * fr - e * e;
      const double wy = e * c - b * fr;
      const double wz = b * e - dr * c;
      const double uu = ux * ux + uy * uy + uz * uz;
      const double vv = vx * vx + vy * vy + vz * vz;
      const double ww = wx * wx + wy * wy + wz * wz;
      const bool v_over_u = vv > uu;
      double nx = v_over_u ? vx : ux;
      double ny = v_over_u ? vy : uy;
      double nz = v_over_u ? vz : uz;
      double nn = v_over_u ? vv : uu;
      const bool w_over = ww > nn;
      nx = w_over ? wx : nx;
      ny = w_over ? wy : ny;
      nz = w_over ? wz : nz;
      nn = w_over ? ww : nn;
      // A point or a line has no plane: all cross products vanish.
      const float length = nn > 1e-14 ? 1.0F / __builtin_sqrtf(static_cast<float>(nn)) : 0.0F;
      const double rest = 1.0 - root;
      const double product = block.c1[i] - root * rest;
      const double square = rest * rest - 4.0 * product;
      const float middle =
          0.5F * static_cast<float>(rest - __builtin_sqrt(square > 0.0 ? square : 0.0));
      fields[0][i] = static_cast<float>(nx) * length;
      fields[1][i] = static_cast<float>(ny) * length;
      fields[2][i] = static_cast<float>(nz) * length;
      fields[6][i] = __builtin_sqrtf(static_cast<float>(root) * block.trace[i]);
      fields[7][i] = __builtin_sqrtf((middle > 0.0F ? middle : 0.0F) * block.trace[i]);
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

std::vector<NoiseSample> noiseSamples(const std::vector<CellFit>& windows, double min_count,
                                      const Vector3& sensor) {
  constexpr double kMinCosine = 0.2;  // more oblique windows tell little about the range
  std::vector<NoiseSample> samples;
  for (const CellFit& fit : windows) {
    if (fit.count < min_count) continue;
    const double ray[3] = {fit.mean[0] - sensor.x(), fit.mean[1] - sensor.y(),
                           fit.mean[2] - sensor.z()};
    const double squared_range = ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2];
    const double along =
        std::fabs(ray[0] * fit.normal[0] + ray[1] * fit.normal[1] + ray[2] * fit.normal[2]);
    if (!(along * along > kMinCosine * kMinCosine * squared_range)) continue;
    const double deviation = fit.residual * std::sqrt(squared_range) / along;
    if (std::isfinite(deviation)) samples.push_back({squared_range, deviation});
  }
  return samples;
}

}  // namespace

CellGrid tileGrid(const TiledCloud& cloud, int threads) {
  CellGrid grid;
  grid.columns = cloud.columns;
  grid.rows = cloud.rows;
  grid.capacity = kTileArea;
  grid.allocate(nullptr);
  parallelFor(static_cast<std::size_t>(cloud.rows), threads, [&](std::size_t row) {
    const int first = static_cast<int>(row) * cloud.columns;
    sumTiles(cloud, first, first + cloud.columns, grid.sums);
  });
  return grid;
}

CellGrid freeQuarterGrid(const TiledCloud& cloud, const std::vector<std::int16_t>& labels,
                         int threads) {
  CellGrid grid;
  grid.columns = 2 * cloud.columns;
  grid.rows = 2 * cloud.rows;
  grid.capacity = kQuarterArea;
  grid.allocate(cloud.room[0]);
  parallelFor(static_cast<std::size_t>(cloud.rows), threads, [&](std::size_t row) {
    const int first = static_cast<int>(row);
    sumFreeQuarters(cloud, labels.data(), first, first + 1, grid.sums);
  });
  return grid;
}

CellGrid windowSums(const CellGrid& grid, int radius, double* room) {
  CellGrid windows;
  windows.columns = grid.columns;
  windows.rows = grid.rows;
  windows.capacity = grid.capacity * (2 * radius + 1) * (2 * radius + 1);
  windows.allocate(room);
  std::vector<double> padded(static_cast<std::size_t>(grid.columns + 2 * radius), 0.0);
  for (int m = 0; m < kMoments; ++m) {
    sumRows(grid.moment(m), grid.columns, grid.rows, radius, windows.moment(m));
    sumColumns(windows.moment(m), grid.columns, grid.rows, radius, padded.data());
  }
  return windows;
}

std::vector<CellFit> fitCells(const CellGrid& grid) {
  std::vector<CellFit> fits(static_cast<std::size_t>(grid.cells()));
  if (!fits.empty()) fitAll(grid.sums, fits.size(), fits.front().normal);
  return fits;
}

CellFit fitSums(const MomentSums& sums) {
  CellFit fit;
  fitAll(sums.data(), 1, fit.normal);
  return fit;
}

RangeNoise estimateNoise(const std::vector<CellFit>& windows, int capacity, const Vector3& sensor,
                         const OrganizedParams& params) {
  constexpr double kFull = 0.8;    // share of a window; emptier ones lie at depth edges
  constexpr double kSparse = 0.3;  // enough where the whole image is sparse
  constexpr std::size_t kBins = 8;
  constexpr std::size_t kMinSamples = 4 * kBins;
  std::vector<NoiseSample> samples = noiseSamples(windows, kFull * capacity, sensor);
  if (samples.size() < kMinSamples) samples = noiseSamples(windows, kSparse * capacity, sensor);
  RangeNoise noise;
  if (samples.size() < kBins) {
    noise.constant = params.assumed_noise * params.distance_threshold;
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
  noise.constant = std::min(noise.constant, params.max_constant_noise * params.distance_threshold);
  noise.quadratic = std::min(noise.quadratic, params.max_quadratic_noise);
  return noise;
}

}  // namespace planar_mapping::detail
