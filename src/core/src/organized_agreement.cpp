// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "organized_agreement.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "organized_lanes.h"
#include "planar_mapping/core/parallel.h"
#include "planar_mapping/core/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr float kFar = 3e38F;

/// The pixels of one plane in one quarter.
struct Share {
  std::int32_t quarter = 0;
  std::int16_t label = -1;
  std::int16_t pixels = 0;
  bool agrees = false;  ///< as far as the noise lets one see
  bool near = false;    ///< the normals of the small ...
  bool wide = false;    ///< ... and of the wide surroundings lie within coherent_angle
};

/// Pixels of a plane.
struct Count {
  double all = 0.0;
  double agreeing = 0.0;
  double near = 0.0;
  double wide = 0.0;

  void add(const Share& share) {
    all += share.pixels;
    agreeing += share.agrees ? share.pixels : 0;
    near += share.near ? share.pixels : 0;
    wide += share.wide ? share.pixels : 0;
  }
};

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

/// Quarters form a grid of 2 columns x 2 rows per tile.
class Surroundings {
 public:
  Surroundings(const TiledCloud& cloud, const OrganizedParams& params, int threads)
      : columns_(2 * cloud.columns),
        rows_(2 * cloud.rows),
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

  int columns() const { return columns_; }
  int rows() const { return rows_; }

  /// Planes of what lies around the quarters, up to \p radius quarters away, at about their range.
  std::vector<CellFit> fits(const std::vector<std::int32_t>& list, int radius, double* room) const {
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
    return fitCells(windows);
  }

 private:
  /// Range difference of one surface; a quarter as spread as this lies across a depth edge.
  float gateAt(float range) const {
    return static_cast<float>(params_.same_surface_constant) +
           static_cast<float>(params_.same_surface_share) * range;
  }

  int columns_;
  int rows_;
  const OrganizedParams& params_;
  int threads_;
  std::vector<MomentSums> sums_;  ///< of all measured points of each quarter
  std::vector<float> range_;      ///< of their mean from the sensor, metres; negative if none
  std::vector<float> spread_;     ///< root mean square distance from the mean, metres
};

/// Angle by which noise may turn the normal of a window, radians.
double normalError(const CellFit& fit, const RangeNoise& noise, const Vector3& sensor,
                   const OrganizedParams& params) {
  const double ray[3] = {fit.mean[0] - sensor.x(), fit.mean[1] - sensor.y(),
                         fit.mean[2] - sensor.z()};
  const double squared_range = ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2];
  const double along =
      std::fabs(ray[0] * fit.normal[0] + ray[1] * fit.normal[1] + ray[2] * fit.normal[2]);
  const double expected = noise.at(squared_range) * along / std::sqrt(squared_range);
  const double sigma = std::min(expected, static_cast<double>(fit.residual));
  const double independent = std::max(1.0, fit.count / params.correlated_normal_pixels);
  const double error = sigma / (fit.extent * std::sqrt(independent));
  return std::isfinite(error) ? error : M_PI_2;
}

double cosine(const PlaneCandidate& plane, const CellFit& fit) {
  return std::fabs(plane.normal[0] * fit.normal[0] + plane.normal[1] * fit.normal[1] +
                   plane.normal[2] * fit.normal[2]);
}

/// Which planes the pixels of each quarter have, ascending by quarter.
std::vector<Share> sharesOf(const TiledCloud& cloud, const PixelAssigner& pixels) {
  std::vector<Share> shares;
  shares.reserve(static_cast<std::size_t>(4) * cloud.tiles());
  for (int row = 0; row < 2 * cloud.rows; ++row) {
    for (int column = 0; column < 2 * cloud.columns; ++column) {
      const int tile = row / 2 * cloud.columns + column / 2;
      if (!pixels.holdsPlane(tile)) continue;
      const std::int16_t* labels =
          pixels.labelsOf(tile) + ((row % 2) * 2 + column % 2) * kQuarterArea;
      const std::int32_t quarter = row * 2 * cloud.columns + column;
      int same = 0;
      for (int k = 0; k < kQuarterArea; ++k) same += labels[k] == labels[0];
      if (same == kQuarterArea) {
        if (labels[0] >= 0)
          shares.push_back({quarter, labels[0], kQuarterArea, false, false, false});
        continue;
      }
      const std::size_t first = shares.size();
      for (int k = 0; k < kQuarterArea; ++k) {
        if (labels[k] < 0) continue;
        std::size_t at = first;
        while (at < shares.size() && shares[at].label != labels[k]) ++at;
        if (at == shares.size()) {
          shares.push_back({quarter, labels[k], 0, false, false, false});
        }
        ++shares[at].pixels;
      }
    }
  }
  return shares;
}

/// Compares the normals around every share with that of its plane.
void compare(const TiledCloud& cloud, const Surroundings& surroundings,
             const std::vector<PlaneCandidate>& planes, const RangeNoise& noise,
             const OrganizedParams& params, std::vector<Share>& shares) {
  std::vector<std::int32_t> all;
  for (const Share& share : shares) {
    if (all.empty() || all.back() != share.quarter) all.push_back(share.quarter);
  }
  const std::vector<CellFit> small =
      surroundings.fits(all, params.small_surroundings, cloud.room[1]);
  const double min_cosine = std::cos(params.coherent_angle);
  std::vector<Count> counts(planes.size());
  std::size_t i = 0;
  for (Share& share : shares) {
    while (all[i] != share.quarter) ++i;
    const auto label = static_cast<std::size_t>(share.label);
    share.near = cosine(planes[label], small[i]) >= min_cosine;
    share.wide = share.agrees = share.near;
    counts[label].add(share);
  }
  // A plane that most small surroundings agree with keeps all its pixels, whatever the others tell.
  const double clear_share = std::max(params.clear_coherent_share, params.min_coherent_share);
  const auto clear = [&](const Share& share) {
    const Count& count = counts[static_cast<std::size_t>(share.label)];
    return count.near >= clear_share * count.all;
  };
  std::vector<std::int32_t> noisy;
  std::vector<const CellFit*> small_of_noisy;
  std::vector<double> errors;
  i = 0;
  for (const Share& share : shares) {
    while (all[i] != share.quarter) ++i;
    if (clear(share) || (!noisy.empty() && noisy.back() == share.quarter)) continue;
    const double error = params.growing_factor * normalError(small[i], noise, cloud.sensor, params);
    if (!(error > params.clear_normal_share * params.coherent_angle)) continue;
    noisy.push_back(share.quarter);
    small_of_noisy.push_back(&small[i]);
    errors.push_back(error);
  }
  const std::vector<CellFit> wide =
      surroundings.fits(noisy, params.wide_surroundings, cloud.room[1]);
  std::size_t j = 0;
  for (Share& share : shares) {
    while (j < noisy.size() && noisy[j] < share.quarter) ++j;
    if (j == noisy.size()) break;
    if (noisy[j] != share.quarter || clear(share)) continue;
    const PlaneCandidate& plane = planes[static_cast<std::size_t>(share.label)];
    share.wide = cosine(plane, wide[j]) >= min_cosine;
    share.agrees = share.near || share.wide;
    if (share.agrees) continue;
    const double allowed =
        std::min(params.most_coherent_angle, std::max(params.coherent_angle, errors[j]));
    share.agrees = cosine(plane, *small_of_noisy[j]) >= std::cos(allowed);
  }
}

}  // namespace

void freeDisagreeing(const TiledCloud& cloud, const std::vector<PlaneCandidate>& planes,
                     const RangeNoise& noise, const OrganizedParams& params, int threads,
                     PixelAssigner& pixels) {
  std::vector<Share> shares = sharesOf(cloud, pixels);
  if (shares.empty()) return;
  const Surroundings surroundings(cloud, params, threads);
  compare(cloud, surroundings, planes, noise, params, shares);

  std::vector<Count> counts(planes.size());
  for (const Share& share : shares) counts[static_cast<std::size_t>(share.label)].add(share);
  std::vector<std::int32_t> first(
      static_cast<std::size_t>(surroundings.columns()) * surroundings.rows() + 1, 0);
  for (const Share& share : shares) ++first[static_cast<std::size_t>(share.quarter) + 1];
  for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];

  std::vector<std::int32_t> disagreeing(shares.size() + 1, 0);  // shares before each
  for (std::size_t i = 0; i < shares.size(); ++i) {
    disagreeing[i + 1] = disagreeing[i] + (shares[i].agrees ? 0 : 1);
  }

  // The majority of the neighbourhood decides: single normals are noisy.
  const auto majority = [&](const Share& share) {
    const int row = share.quarter / surroundings.columns();
    const int column = share.quarter % surroundings.columns();
    const int top = std::max(0, row - 1);
    const int bottom = std::min(surroundings.rows() - 1, row + 1);
    const int left = std::max(0, column - 1);
    const int right = std::min(surroundings.columns() - 1, column + 1);
    std::int32_t doubtful = 0;
    for (int r = top; r <= bottom; ++r) {
      const auto line = static_cast<std::size_t>(r) * surroundings.columns();
      doubtful += disagreeing[static_cast<std::size_t>(first[line + right + 1])] -
                  disagreeing[static_cast<std::size_t>(first[line + left])];
    }
    if (doubtful == 0) return true;
    int agreeing = 0;
    int all = 0;
    for (int r = top; r <= bottom; ++r) {
      const auto line = static_cast<std::size_t>(r) * surroundings.columns();
      for (std::int32_t k = first[line + left]; k < first[line + right + 1]; ++k) {
        const Share& other = shares[static_cast<std::size_t>(k)];
        if (other.label != share.label) continue;
        all += other.pixels;
        agreeing += other.agrees ? other.pixels : 0;
      }
    }
    return 2 * agreeing >= all;
  };
  // Shares that stay; of them as many must agree without allowance for noise.
  std::vector<char> stays(shares.size());
  std::vector<Count> remaining(planes.size());
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const Share& share = shares[i];
    const auto label = static_cast<std::size_t>(share.label);
    stays[i] = counts[label].agreeing >= params.clear_coherent_share * counts[label].all ||
               majority(share);
    if (stays[i]) remaining[label].add(share);
  }
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const Share& share = shares[i];
    const Count& count = remaining[static_cast<std::size_t>(share.label)];
    if (stays[i] && std::max(count.near, count.wide) >= params.min_coherent_share * count.all) {
      continue;
    }
    const int row = share.quarter / surroundings.columns();
    const int column = share.quarter % surroundings.columns();
    pixels.free(row / 2 * cloud.columns + column / 2, (row % 2) * 2 + column % 2, share.label);
  }
  pixels.recount();
}

}  // namespace planar_mapping::detail
