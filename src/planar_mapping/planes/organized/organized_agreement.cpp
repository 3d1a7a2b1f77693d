// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/organized/organized_assignment.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr int kSmallRadius = 1;  ///< quarters around one whose normal tells how it lies ...
constexpr int kWideRadius = 3;   ///< ... and where noise turns that normal

/// Adds up the quarters of a window that are at about the range given and not spread.
PLANAR_MAPPING_MULTIVERSION
void sumGated(const double* sums, const float* range, const float* spread, int columns, int rows,
              int width, float at, float gate, double* out) {
  using Eight = double __attribute__((vector_size(8 * sizeof(double))));
  using Two = double __attribute__((vector_size(2 * sizeof(double))));
  static_assert(kMoments == 10, "the sums of a quarter are a vector of eight and one of two");
  Eight first = {};
  Two second = {};
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < width; ++column) {
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

/// How the measured points around the quarters of tiles lie, of a plane or not. Quarters form a
/// grid of 2 columns x 2 rows per tile.
class Surroundings {
 public:
  Surroundings(const TiledCloud& cloud, const OrganizedParams& params, int threads)
      : columns(2 * cloud.columns),
        rows(2 * cloud.rows),
        cloud_(cloud),
        params_(params),
        threads_(threads),
        sums_(static_cast<std::size_t>(columns) * rows),
        range_(sums_.size(), -1.0F),
        spread_(sums_.size(), 0.0F) {
    parallelFor(static_cast<std::size_t>(cloud.rows), threads, [&](std::size_t row) {
      const std::size_t begin = 2 * row * static_cast<std::size_t>(columns);
      static_assert(sizeof(MomentSums) == kMoments * sizeof(double), "written as plain numbers");
      sumQuarters(cloud.x(static_cast<int>(row) * cloud.columns), cloud.columns,
                  sums_[begin].data());
      for (std::size_t i = begin; i < begin + 2 * static_cast<std::size_t>(columns); ++i) {
        const MomentSums& s = sums_[i];
        if (!(s[kN] > 0.0)) continue;
        const Vector3 mean = meanOf(s);
        const double square = (s[kXX] + s[kYY] + s[kZZ]) / s[kN] - mean.squaredNorm();
        range_[i] = static_cast<float>((mean - cloud.sensor).norm());
        spread_[i] = std::sqrt(std::max(0.0F, static_cast<float>(square)));
      }
    });
  }

  /// Planes of what lies around the quarters, up to \p radius quarters away, at about their range.
  CellFits fits(const std::vector<std::int32_t>& quarters, int radius) const {
    constexpr std::size_t kChunk = 512;
    CellGrid windows(static_cast<int>(quarters.size()), 1, 0);
    parallelFor((quarters.size() + kChunk - 1) / kChunk, threads_, [&](std::size_t chunk) {
      const std::size_t end = std::min(quarters.size(), (chunk + 1) * kChunk);
      for (std::size_t i = chunk * kChunk; i < end; ++i) {
        const auto at = static_cast<std::size_t>(quarters[i]);
        const Window window = around(quarters[i], radius);
        // Range difference of one surface; a quarter as spread as this lies across a depth edge.
        const float gate = static_cast<float>(params_.same_surface_constant) +
                           static_cast<float>(params_.same_surface_fraction) * range_[at];
        const std::size_t first = static_cast<std::size_t>(window.top) * columns + window.left;
        MomentSums sums;
        sumGated(sums_[first].data(), &range_[first], &spread_[first], columns,
                 window.bottom - window.top + 1, window.right - window.left + 1, range_[at], gate,
                 sums.data());
        // The quarter itself counts however spread it is.
        if (spread_[at] > gate) addSums(sums, sums_[at]);
        windows.set(i, sums);
      }
    });
    return fitCells(windows, cloud_.sensor);
  }

  struct Window {
    int top, bottom, left, right;
  };
  /// Quarters up to \p radius away, cut off at the border.
  Window around(std::int32_t quarter, int radius) const {
    const int row = quarter / columns;
    const int column = quarter % columns;
    return {std::max(0, row - radius), std::min(rows - 1, row + radius),
            std::max(0, column - radius), std::min(columns - 1, column + radius)};
  }

  const int columns;
  const int rows;

 private:
  const TiledCloud& cloud_;
  const OrganizedParams& params_;
  int threads_;
  std::vector<MomentSums> sums_;  ///< of all measured points of each quarter
  std::vector<float> range_;      ///< of their mean from the sensor, metres; negative if none
  std::vector<float> spread_;     ///< root mean square distance from the mean, metres
};

/// The pixels of one plane in one quarter.
struct TilePiece {
  std::int32_t quarter = 0;
  std::int32_t speaker = 0;  ///< the quarter whose surroundings tell how it lies
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

  void add(const TilePiece& piece) {
    if (piece.undecided) return;
    all += piece.pixels;
    agreeing += piece.agrees ? piece.pixels : 0;
    near += piece.near ? piece.pixels : 0;
    wide += piece.wide ? piece.pixels : 0;
  }
};

/// Which planes the pixels of each quarter have, ascending by quarter. Inside a plane one quarter
/// of a tile speaks for all four.
std::vector<TilePiece> piecesOf(const TiledCloud& cloud, const PixelAssigner& pixels) {
  std::vector<TilePiece> pieces;
  pieces.reserve(static_cast<std::size_t>(4) * cloud.tiles());
  const std::int32_t columns = 2 * cloud.columns;
  std::vector<char> inside(static_cast<std::size_t>(cloud.tiles()));
  for (int tile = 0; tile < cloud.tiles(); ++tile)
    inside[static_cast<std::size_t>(tile)] = pixels.isInside(tile) ? 1 : 0;
  for (int row = 0; row < 2 * cloud.rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const int tile = row / 2 * cloud.columns + column / 2;
      if (!pixels.holdsPlane(tile)) continue;
      const std::int32_t quarter = row * columns + column;
      if (const std::int16_t whole = pixels.wholePlane(tile); whole >= 0) {
        const std::int32_t first = (row - row % 2) * columns + column - column % 2;
        const bool is_inside = inside[static_cast<std::size_t>(tile)] != 0;
        pieces.push_back({quarter, is_inside ? first : quarter, whole, kQuarterArea});
        continue;
      }
      const std::int16_t* labels =
          pixels.labelsOf(tile) + ((row % 2) * 2 + column % 2) * kQuarterArea;
      const std::size_t first = pieces.size();
      for (int k = 0; k < kQuarterArea; ++k) {
        if (labels[k] < 0) continue;
        std::size_t at = first;
        while (at < pieces.size() && pieces[at].label != labels[k]) ++at;
        if (at == pieces.size()) pieces.push_back({quarter, quarter, labels[k], 0});
        ++pieces[at].pixels;
      }
    }
  }
  return pieces;
}

/// The pieces of all quarters, found by place.
class PieceGrid {
 public:
  PieceGrid(const std::vector<TilePiece>& pieces, const Surroundings& surroundings)
      : pieces_(pieces),
        surroundings_(surroundings),
        first_(static_cast<std::size_t>(surroundings.columns) * surroundings.rows + 1, 0) {
    for (const TilePiece& piece : pieces) ++first_[static_cast<std::size_t>(piece.quarter) + 1];
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  }

  /// Calls visit(piece) for those of the same plane up to \p radius quarters away.
  /// \return pixels of all quarters within that reach, of the plane or not
  template <typename Visit>
  int forSamePlane(const TilePiece& piece, int radius, const Visit& visit) const {
    const Surroundings::Window window = surroundings_.around(piece.quarter, radius);
    for (int row = window.top; row <= window.bottom; ++row) {
      const auto line = static_cast<std::size_t>(row) * surroundings_.columns;
      for (std::int32_t k = first_[line + window.left]; k < first_[line + window.right + 1]; ++k) {
        const TilePiece& other = pieces_[static_cast<std::size_t>(k)];
        if (other.label == piece.label) visit(other);
      }
    }
    return (window.bottom - window.top + 1) * (window.right - window.left + 1) * kQuarterArea;
  }

 private:
  const std::vector<TilePiece>& pieces_;
  const Surroundings& surroundings_;
  std::vector<std::int32_t> first_;  ///< piece of each quarter, and one past the last
};

/// Some quarters, and the fits of what lies around them.
struct Sample {
  std::vector<std::int32_t> quarters;
  std::vector<std::int32_t> place;  ///< of each quarter of the image in quarters, -1 = not in it

  explicit Sample(const Surroundings& surroundings)
      : place(static_cast<std::size_t>(surroundings.columns) * surroundings.rows, -1) {}

  bool holds(std::int32_t quarter) const { return place[static_cast<std::size_t>(quarter)] >= 0; }
  void add(std::int32_t quarter) {
    if (holds(quarter)) return;
    place[static_cast<std::size_t>(quarter)] = static_cast<std::int32_t>(quarters.size());
    quarters.push_back(quarter);
  }
  const CellFit& of(const CellFits& fits, std::int32_t quarter) const {
    return fits[static_cast<std::size_t>(place[static_cast<std::size_t>(quarter)])];
  }
};

/// Compares the normals around every piece with that of its plane.
void compare(const TiledCloud& cloud, const Surroundings& surroundings,
             const std::vector<PlaneCandidate>& planes, const MetricFit& fit, const PieceGrid& grid,
             std::vector<TilePiece>& pieces) {
  const OrganizedParams& params = fit.params();
  Sample all(surroundings);
  for (const TilePiece& piece : pieces) all.add(piece.speaker);
  const CellFits small = surroundings.fits(all.quarters, kSmallRadius);
  const double min_cosine = std::cos(params.coherent_angle);
  std::vector<Count> counts(planes.size());
  for (TilePiece& piece : pieces) {
    const auto label = static_cast<std::size_t>(piece.label);
    piece.near = planes[label].cosine(all.of(small, piece.speaker).normal) >= min_cosine;
    piece.wide = piece.agrees = piece.near;
    if (!piece.near) {
      int own = 0;
      const int within = grid.forSamePlane(piece, kSmallRadius,
                                           [&](const TilePiece& other) { own += other.pixels; });
      if (2 * own < within) piece.undecided = piece.agrees = true;
    }
    counts[label].add(piece);
  }
  // A plane that most small surroundings agree with keeps all its pixels, whatever the others tell.
  const auto clear = [&](const TilePiece& piece) {
    const Count& count = counts[static_cast<std::size_t>(piece.label)];
    return piece.undecided || count.near >= params.clear_coherent_fraction * count.all;
  };
  const auto error = [&](std::int32_t quarter) {
    return params.growing_factor *
           normalError(all.of(small, quarter), fit.noise(), cloud.sensor, params);
  };
  Sample noisy(surroundings);
  for (const TilePiece& piece : pieces) {
    if (clear(piece) || noisy.holds(piece.speaker)) continue;
    if (error(piece.speaker) > params.clear_normal_fraction * params.coherent_angle)
      noisy.add(piece.speaker);
  }
  // Wide surroundings reach beyond the small planes that stand out of white noise: they do not
  // count against them.
  const bool white = fit.isWhite();
  CellFits wide;
  if (!white) wide = surroundings.fits(noisy.quarters, kWideRadius);
  for (TilePiece& piece : pieces) {
    if (!noisy.holds(piece.speaker) || clear(piece)) continue;
    if (white) {
      piece.near = piece.wide = piece.agrees = true;
      continue;
    }
    const PlaneCandidate& plane = planes[static_cast<std::size_t>(piece.label)];
    piece.wide = plane.cosine(noisy.of(wide, piece.speaker).normal) >= min_cosine;
    piece.agrees = piece.near || piece.wide;
    if (piece.agrees) continue;
    const double allowed =
        std::min(params.most_coherent_angle, std::max(params.coherent_angle, error(piece.speaker)));
    piece.agrees = plane.cosine(all.of(small, piece.speaker).normal) >= std::cos(allowed);
  }
}

}  // namespace

void freeDisagreeing(const TiledCloud& cloud, const std::vector<PlaneCandidate>& planes,
                     const MetricFit& fit, int threads, PixelAssigner& pixels) {
  const OrganizedParams& params = fit.params();
  std::vector<TilePiece> pieces = piecesOf(cloud, pixels);
  if (pieces.empty()) return;
  const Surroundings surroundings(cloud, params, threads);
  const PieceGrid grid(pieces, surroundings);
  compare(cloud, surroundings, planes, fit, grid, pieces);

  std::vector<Count> counts(planes.size());
  for (const TilePiece& piece : pieces) counts[static_cast<std::size_t>(piece.label)].add(piece);

  // The majority of the neighbourhood decides: single normals are noisy.
  const auto majority = [&](const TilePiece& piece) {
    int agreeing = 0;
    int all = 0;
    grid.forSamePlane(piece, 1, [&](const TilePiece& other) {
      all += other.pixels;
      agreeing += other.agrees ? other.pixels : 0;
    });
    return 2 * agreeing >= all;
  };
  // Pieces that stay; of them as many must agree without allowance for noise.
  std::vector<char> stays(pieces.size());
  std::vector<Count> remaining(planes.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const TilePiece& piece = pieces[i];
    const auto label = static_cast<std::size_t>(piece.label);
    stays[i] = counts[label].agreeing >= params.clear_coherent_fraction * counts[label].all ||
               majority(piece);
    if (stays[i]) remaining[label].add(piece);
  }
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const TilePiece& piece = pieces[i];
    const Count& count = remaining[static_cast<std::size_t>(piece.label)];
    if (stays[i] && std::max(count.near, count.wide) >= params.min_coherent_fraction * count.all) {
      continue;
    }
    const int row = piece.quarter / surroundings.columns;
    const int column = piece.quarter % surroundings.columns;
    pixels.free(row / 2 * cloud.columns + column / 2, (row % 2) * 2 + column % 2, piece.label);
  }
  pixels.recount();
}

}  // namespace planar_mapping::detail
