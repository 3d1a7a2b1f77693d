// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/organized/organized_agreement.h"

#include <algorithm>
#include <cmath>

#include "planes/organized/organized_surroundings.h"

namespace planar_mapping::detail {
namespace {

/// The pixels of one plane in one quarter.
struct Share {
  std::int32_t quarter = 0;
  std::int16_t label = -1;
  std::int16_t pixels = 0;
  bool agrees = false;     ///< as far as the noise lets one see
  bool near = false;       ///< the normals of the small ...
  bool wide = false;       ///< ... and of the wide surroundings lie within coherent_angle
  bool undecided = false;  ///< mostly other planes around: their normal tells nothing
};

/// Pixels of a plane.
struct Count {
  double all = 0.0;
  double agreeing = 0.0;
  double near = 0.0;
  double wide = 0.0;

  void add(const Share& share) {
    if (share.undecided) return;
    all += share.pixels;
    agreeing += share.agrees ? share.pixels : 0;
    near += share.near ? share.pixels : 0;
    wide += share.wide ? share.pixels : 0;
  }
};

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
          shares.push_back({quarter, labels[0], kQuarterArea, false, false, false, false});
        continue;
      }
      const std::size_t first = shares.size();
      for (int k = 0; k < kQuarterArea; ++k) {
        if (labels[k] < 0) continue;
        std::size_t at = first;
        while (at < shares.size() && shares[at].label != labels[k]) ++at;
        if (at == shares.size()) {
          shares.push_back({quarter, labels[k], 0, false, false, false, false});
        }
        ++shares[at].pixels;
      }
    }
  }
  return shares;
}

/// Where the shares of each quarter begin, and one past the last.
std::vector<std::int32_t> firstShares(const std::vector<Share>& shares,
                                      const Surroundings& surroundings) {
  std::vector<std::int32_t> first(
      static_cast<std::size_t>(surroundings.columns()) * surroundings.rows() + 1, 0);
  for (const Share& share : shares) ++first[static_cast<std::size_t>(share.quarter) + 1];
  for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
  return first;
}

/// Whether enough of the small surroundings of a share has its plane.
bool isInside(const Share& share, const std::vector<Share>& shares,
              const std::vector<std::int32_t>& first, const Surroundings& surroundings,
              const OrganizedParams& params) {
  const int radius = params.small_surroundings;
  const int columns = surroundings.columns();
  const int row = share.quarter / columns;
  const int column = share.quarter % columns;
  const int left = std::max(0, column - radius);
  const int right = std::min(columns - 1, column + radius);
  int own = 0;
  int all = 0;
  for (int r = std::max(0, row - radius); r <= std::min(surroundings.rows() - 1, row + radius);
       ++r) {
    const auto line = static_cast<std::size_t>(r) * columns;
    for (std::int32_t k = first[line + left]; k < first[line + right + 1]; ++k) {
      const Share& other = shares[static_cast<std::size_t>(k)];
      own += other.label == share.label ? other.pixels : 0;
    }
    all += (right - left + 1) * kQuarterArea;
  }
  return own >= params.min_own_share * all;
}

/// Compares the normals around every share with that of its plane.
void compare(const TiledCloud& cloud, const Surroundings& surroundings,
             const std::vector<PlaneCandidate>& planes, const MetricFit& fit,
             const std::vector<std::int32_t>& first, std::vector<Share>& shares) {
  const OrganizedParams& params = fit.params();
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
    share.near = planes[label].cosine(small[i].normal) >= min_cosine;
    share.wide = share.agrees = share.near;
    if (!share.near && !isInside(share, shares, first, surroundings, params)) {
      share.undecided = share.agrees = true;
    }
    counts[label].add(share);
  }
  // A plane that most small surroundings agree with keeps all its pixels, whatever the others tell.
  const double clear_share = std::max(params.clear_coherent_share, params.min_coherent_share);
  const auto clear = [&](const Share& share) {
    const Count& count = counts[static_cast<std::size_t>(share.label)];
    return share.undecided || count.near >= clear_share * count.all;
  };
  std::vector<std::int32_t> noisy;
  std::vector<const CellFit*> small_of_noisy;
  std::vector<double> errors;
  i = 0;
  for (const Share& share : shares) {
    while (all[i] != share.quarter) ++i;
    if (clear(share) || (!noisy.empty() && noisy.back() == share.quarter)) continue;
    const double error =
        params.growing_factor * normalError(small[i], fit.noise(), cloud.sensor, params);
    if (!(error > params.clear_normal_share * params.coherent_angle)) continue;
    noisy.push_back(share.quarter);
    small_of_noisy.push_back(&small[i]);
    errors.push_back(error);
  }
  const std::vector<CellFit> wide =
      surroundings.fits(noisy, params.wide_surroundings, cloud.room[1]);
  // Wide surroundings reach beyond the small planes that stand out of white noise: they do not
  // count against them.
  const bool white = fit.noise().correlated_pixels <= params.white_correlation;
  std::size_t j = 0;
  for (Share& share : shares) {
    while (j < noisy.size() && noisy[j] < share.quarter) ++j;
    if (j == noisy.size()) break;
    if (noisy[j] != share.quarter || clear(share)) continue;
    if (white) {
      share.near = share.wide = share.agrees = true;
      continue;
    }
    const PlaneCandidate& plane = planes[static_cast<std::size_t>(share.label)];
    share.wide = plane.cosine(wide[j].normal) >= min_cosine;
    share.agrees = share.near || share.wide;
    if (share.agrees) continue;
    const double allowed =
        std::min(params.most_coherent_angle, std::max(params.coherent_angle, errors[j]));
    share.agrees = plane.cosine(small_of_noisy[j]->normal) >= std::cos(allowed);
  }
}

}  // namespace

void freeDisagreeing(const TiledCloud& cloud, const std::vector<PlaneCandidate>& planes,
                     const MetricFit& fit, int threads, PixelAssigner& pixels) {
  const OrganizedParams& params = fit.params();
  std::vector<Share> shares = sharesOf(cloud, pixels);
  if (shares.empty()) return;
  const Surroundings surroundings(cloud, params, threads);
  const std::vector<std::int32_t> first = firstShares(shares, surroundings);
  compare(cloud, surroundings, planes, fit, first, shares);

  std::vector<Count> counts(planes.size());
  for (const Share& share : shares) counts[static_cast<std::size_t>(share.label)].add(share);

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
