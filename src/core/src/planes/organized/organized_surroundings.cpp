// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/organized/organized_surroundings.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/organized_lanes.h"
#include "planar_mapping/core/base/detail/parallel.h"
#include "planar_mapping/core/base/detail/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr float kFar = 3e38F;

/// The windows around one row of quarters: sums, smallest and largest range, largest spread.
struct WindowRow {
  WindowRow(int columns, int radius)
      : sums(static_cast<std::size_t>(columns) * kMoments),
        least(static_cast<std::size_t>(columns)),
        most(least.size()),
        spread(least.size()),
        padded(static_cast<std::size_t>(columns + 2 * radius) * kMoments, 0.0),
        padded_least(static_cast<std::size_t>(columns + 2 * radius), kFar),
        padded_most(padded_least.size(), -1.0F),
        padded_spread(padded_least.size(), 0.0F) {}

  struct Pointers {
    double *sums, *padded;
    float *least, *most, *spread, *padded_least, *padded_most, *padded_spread;
  };
  Pointers scratch() {
    return {sums.data(),   padded.data(),       least.data(),       most.data(),
            spread.data(), padded_least.data(), padded_most.data(), padded_spread.data()};
  }

  std::vector<double> sums;
  std::vector<float> least, most, spread;
  std::vector<double> padded;  ///< sums over the rows, with empty columns at both ends
  std::vector<float> padded_least, padded_most, padded_spread;
};

PLANAR_MAPPING_INLINE void sumShifted(const WindowRow::Pointers& to, int columns, int radius) {
  for (int i = 0; i < columns * kMoments; ++i) {
    double sum = to.padded[i];
    for (int shift = 1; shift <= 2 * radius; ++shift) sum += to.padded[i + shift * kMoments];
    to.sums[i] = sum;
  }
  for (int i = 0; i < columns; ++i) {
    float least = to.padded_least[i];
    float most = to.padded_most[i];
    float spread = to.padded_spread[i];
    for (int k = i + 1; k <= i + 2 * radius; ++k) {
      least = to.padded_least[k] < least ? to.padded_least[k] : least;
      most = to.padded_most[k] > most ? to.padded_most[k] : most;
      spread = to.padded_spread[k] > spread ? to.padded_spread[k] : spread;
    }
    to.least[i] = least;
    to.most[i] = most;
    to.spread[i] = spread;
  }
}

/// Over windows of \p rows rows from the first, 2 radius + 1 columns wide.
PLANAR_MAPPING_MULTIVERSION
void sumWindows(const double* sums, const float* range, const float* spread, int columns, int rows,
                int radius, WindowRow::Pointers to) {
  const int values = columns * kMoments;
  double* padded = to.padded + radius * kMoments;
  for (int row = 0; row < rows; ++row) {
    const double* line = sums + static_cast<std::size_t>(row) * values;
    const float* ranges = range + static_cast<std::size_t>(row) * columns;
    const float* spreads = spread + static_cast<std::size_t>(row) * columns;
    for (int i = 0; i < values; ++i) padded[i] += line[i];
    float* least = to.padded_least + radius;
    float* most = to.padded_most + radius;
    float* widest = to.padded_spread + radius;
    for (int i = 0; i < columns; ++i) {
      const float near = ranges[i] >= 0.0F ? ranges[i] : kFar;
      least[i] = near < least[i] ? near : least[i];
      most[i] = ranges[i] > most[i] ? ranges[i] : most[i];
      widest[i] = spreads[i] > widest[i] ? spreads[i] : widest[i];
    }
  }
  // The usual radii as constants, so that the loop over columns is the outer one.
  switch (radius) {
    case 1:
      return sumShifted(to, columns, 1);
    case 3:
      return sumShifted(to, columns, 3);
    default:
      return sumShifted(to, columns, radius);
  }
}

/// Over the quarters of a window that are at about the range given and not spread.
PLANAR_MAPPING_MULTIVERSION
void sumGated(const double* sums, const float* range, const float* spread, int columns, int rows,
              int left, int right, float at, float gate, double* out) {
  using Eight = double __attribute__((vector_size(8 * sizeof(double))));
  using Two = double __attribute__((vector_size(2 * sizeof(double))));
  static_assert(kMoments == 10, "the sums of a quarter are a vector of eight and one of two");
  Eight first = {};
  Two second = {};
  for (int row = 0; row < rows; ++row) {
    for (int column = left; column <= right; ++column) {
      const std::size_t i = static_cast<std::size_t>(row) * columns + column;
      if (!(__builtin_fabsf(range[i] - at) <= gate && spread[i] <= gate)) continue;
      Eight eight;
      Two two;
      std::memcpy(&eight, sums + i * kMoments, sizeof(eight));
      std::memcpy(&two, sums + i * kMoments + 8, sizeof(two));
      first += eight;
      second += two;
    }
  }
  std::memcpy(out, &first, sizeof(first));
  std::memcpy(out + 8, &second, sizeof(second));
}

}  // namespace

Surroundings::Surroundings(const TiledCloud& cloud, const OrganizedParams& params, int threads)
    : columns_(2 * cloud.columns),
      rows_(2 * cloud.rows),
      sensor_(cloud.sensor),
      params_(params),
      threads_(threads),
      sums_(static_cast<std::size_t>(columns_) * rows_),
      range_(sums_.size(), -1.0F),
      spread_(sums_.size(), 0.0F) {
  parallelFor(static_cast<std::size_t>(cloud.rows), threads, [&](std::size_t row) {
    const std::size_t begin = 2 * row * static_cast<std::size_t>(columns_);
    sumQuarters(cloud, static_cast<int>(row), &sums_[begin]);
    for (std::size_t i = begin; i < begin + 2 * static_cast<std::size_t>(columns_); ++i) {
      const MomentSums& s = sums_[i];
      if (!(s[kN] > 0.0)) continue;
      const double inverse = 1.0 / s[kN];
      const double x = s[kX] * inverse;
      const double y = s[kY] * inverse;
      const double z = s[kZ] * inverse;
      const double square = (s[kXX] + s[kYY] + s[kZZ]) * inverse - (x * x + y * y + z * z);
      const double rx = x - cloud.sensor.x();
      const double ry = y - cloud.sensor.y();
      const double rz = z - cloud.sensor.z();
      range_[i] = std::sqrt(static_cast<float>(rx * rx + ry * ry + rz * rz));
      spread_[i] = std::sqrt(std::max(0.0F, static_cast<float>(square)));
    }
  });
}

std::vector<CellFit> Surroundings::fits(const std::vector<std::int32_t>& list, int radius,
                                        double* room) const {
  CellGrid windows;
  windows.columns = static_cast<int>(list.size());
  windows.rows = 1;
  windows.allocate(room);
  parallelFor(static_cast<std::size_t>(rows_), threads_, [&](std::size_t row) {
    const auto first = static_cast<std::int32_t>(row) * columns_;
    auto at = std::lower_bound(list.begin(), list.end(), first);
    const auto end = std::lower_bound(at, list.end(), first + columns_);
    if (at == end) return;
    WindowRow sums(columns_, radius);
    const int from = std::max(0, static_cast<int>(row) - radius);
    const int to = std::min(rows_ - 1, static_cast<int>(row) + radius);
    const std::size_t corner = static_cast<std::size_t>(from) * columns_;
    sumWindows(sums_[corner].data(), &range_[corner], &spread_[corner], columns_, to - from + 1,
               radius, sums.scratch());
    for (; at != end; ++at) {
      const auto centre = static_cast<std::size_t>(*at);
      const auto column = static_cast<std::size_t>(*at - first);
      const float gate = gateAt(range_[centre]);
      // Mostly all quarters of a window lie on one surface.
      const bool all = sums.least[column] >= range_[centre] - gate &&
                       sums.most[column] <= range_[centre] + gate && sums.spread[column] <= gate;
      MomentSums gated;
      if (!all) {
        const int left = std::max(0, static_cast<int>(column) - radius);
        const int right = std::min(columns_ - 1, static_cast<int>(column) + radius);
        sumGated(sums_[corner].data(), &range_[corner], &spread_[corner], columns_, to - from + 1,
                 left, right, range_[centre], gate, gated.data());
        // The centre counts however spread it is.
        if (spread_[centre] > gate) addSums(gated, sums_[centre]);
      }
      const double* window = all ? &sums.sums[column * kMoments] : gated.data();
      const auto i = static_cast<std::size_t>(at - list.begin());
      for (int m = 0; m < kMoments; ++m) windows.moment(m)[i] = window[m];
    }
  });
  return fitCells(windows, sensor_);
}

}  // namespace planar_mapping::detail
