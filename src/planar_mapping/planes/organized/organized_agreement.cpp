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
  Surroundings(const TiledCloud& cloud, const OrganizedParams& params)
      : columns(2 * cloud.columns),
        rows(2 * cloud.rows),
        cloud_(cloud),
        params_(params),
        sums_(static_cast<std::size_t>(columns) * rows),
        range_(sums_.size()),
        spread_(sums_.size()),
        is_summed_(static_cast<std::size_t>(cloud.tiles()), 0) {}

  /// Planes of what lies around the quarters, up to \p radius quarters away, at about their range.
  CellFits fits(const std::vector<std::int32_t>& quarters, int radius) {
    sumAround(quarters, radius);
    constexpr std::size_t kChunk = 512;
    CellSums windows(quarters.size());
    parallelFor((quarters.size() + kChunk - 1) / kChunk, params_.threads, [&](std::size_t chunk) {
      const std::size_t end = std::min(quarters.size(), (chunk + 1) * kChunk);
      for (std::size_t i = chunk * kChunk; i < end; ++i) {
        const auto at = static_cast<std::size_t>(quarters[i]);
        const Window window = around(quarters[i], radius);
        // Range difference of one surface; a quarter as spread as this lies across a depth edge.
        const float gate = static_cast<float>(params_.same_surface_constant) +
                           static_cast<float>(params_.same_surface_fraction) * range_[at];
        const std::size_t first = static_cast<std::size_t>(window.top) * columns + window.left;
        sumGated(sums_[first].data(), &range_[first], &spread_[first], columns,
                 window.bottom - window.top + 1, window.right - window.left + 1, range_[at], gate,
                 windows[i].data());
        // The quarter itself counts however spread it is.
        if (spread_[at] > gate) addSums(windows[i], sums_[at]);
      }
    });
    return fitCells(windows, cloud_.sensor, params_.threads);
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
  /// Sums the quarters of the tiles that the windows reach.
  void sumAround(const std::vector<std::int32_t>& quarters, int radius) {
    constexpr char kWanted = 2;
    for (const std::int32_t quarter : quarters) {
      const Window window = around(quarter, radius);
      for (int row = window.top / 2; row <= window.bottom / 2; ++row) {
        char* line = is_summed_.data() + static_cast<std::size_t>(row) * cloud_.columns;
        for (int column = window.left / 2; column <= window.right / 2; ++column)
          line[column] = line[column] == 0 ? kWanted : line[column];
      }
    }
    parallelFor(static_cast<std::size_t>(cloud_.rows), params_.threads, [&](std::size_t row) {
      for (int column = 0; column < cloud_.columns; ++column) {
        const std::size_t tile = row * static_cast<std::size_t>(cloud_.columns) + column;
        if (is_summed_[tile] == kWanted) sumTile(static_cast<int>(tile));
      }
    });
  }

  void sumTile(int tile) {
    is_summed_[static_cast<std::size_t>(tile)] = 1;
    MomentSums of[4];
    sumQuarters(cloud_.x(tile), of[0].data());
    const std::size_t first = static_cast<std::size_t>(tile / cloud_.columns) * 2 * columns +
                              static_cast<std::size_t>(tile % cloud_.columns) * 2;
    for (std::size_t quarter = 0; quarter < 4; ++quarter) {
      const MomentSums& s = of[quarter];
      const std::size_t i = first + quarter / 2 * columns + quarter % 2;
      sums_[i] = s;
      range_[i] = -1.0F;
      spread_[i] = 0.0F;
      if (!(s[kN] > 0.0)) continue;
      const Vector3 mean = meanOf(s);
      const double square = (s[kXX] + s[kYY] + s[kZZ]) / s[kN] - mean.squaredNorm();
      range_[i] = static_cast<float>((mean - cloud_.sensor).norm());
      spread_[i] = std::sqrt(std::max(0.0F, static_cast<float>(square)));
    }
  }

  const TiledCloud& cloud_;
  const OrganizedParams& params_;
  CellSums sums_;                            ///< of all measured points of each quarter
  std::vector<float, Unset<float>> range_;   ///< of their mean, metres; negative if none
  std::vector<float, Unset<float>> spread_;  ///< root mean square distance from the mean, metres
  std::vector<char> is_summed_;              ///< tiles
};

/// The pixels of one plane in one quarter.
struct TilePiece {
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

  void add(const TilePiece& piece) {
    if (piece.undecided) return;
    all += piece.pixels;
    agreeing += piece.agrees ? piece.pixels : 0;
    near += piece.near ? piece.pixels : 0;
    wide += piece.wide ? piece.pixels : 0;
  }
};

/// Which planes must be looked at in pieces: those that do not lie as most of their inside does, or
/// have little of it. The window of 3 x 3 tiles tells how the inside of a plane lies.
std::vector<char> doubtfulPlanes(const std::vector<PlaneCandidate>& planes, const CellFits& windows,
                                 const OrganizedParams& params, PixelAssigner& pixels) {
  const double min_cosine = std::cos(params.coherent_angle);
  std::vector<Count> counts(planes.size());
  std::vector<double> all(planes.size(), 0.0);
  for (const TilePart& part : pixels.parts()) {
    const auto label = static_cast<std::size_t>(part.label);
    all[label] += part.sums[kN];
    if (!pixels.isInside(part.tile)) continue;
    counts[label].all += part.sums[kN];
    const CellFit& window = windows[static_cast<std::size_t>(part.tile)];
    if (planes[label].cosine(window.normal) >= min_cosine) counts[label].near += part.sums[kN];
  }
  std::vector<char> doubtful(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    doubtful[i] = counts[i].all < params.min_inside_fraction * all[i] ||
                  counts[i].near < params.clear_coherent_fraction * counts[i].all;
  }
  return doubtful;
}

/// Which of the doubtful planes the pixels of each quarter have, ascending by quarter.
std::vector<TilePiece> piecesOf(const TiledCloud& cloud, const PixelAssigner& pixels,
                                const std::vector<char>& doubtful) {
  std::vector<TilePiece> pieces;
  const std::int32_t columns = 2 * cloud.columns;
  for (int row = 0; row < 2 * cloud.rows; ++row) {
    for (int tile = row / 2 * cloud.columns; tile < (row / 2 + 1) * cloud.columns; ++tile) {
      if (!pixels.holdsAny(tile, doubtful)) continue;
      for (int half = 0; half < 2; ++half) {
        const std::int32_t quarter = row * columns + tile % cloud.columns * 2 + half;
        const std::int16_t* labels = pixels.labelsOf(tile) + ((row % 2) * 2 + half) * kQuarterArea;
        const std::size_t first = pieces.size();
        for (int k = 0; k < kQuarterArea; ++k) {
          if (labels[k] < 0 || !doubtful[static_cast<std::size_t>(labels[k])]) continue;
          std::size_t at = first;
          while (at < pieces.size() && pieces[at].label != labels[k]) ++at;
          if (at == pieces.size()) pieces.push_back({quarter, labels[k], 0});
          ++pieces[at].pixels;
        }
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
void compare(const TiledCloud& cloud, Surroundings& surroundings,
             const std::vector<PlaneCandidate>& planes, const MetricFit& fit, const PieceGrid& grid,
             std::vector<TilePiece>& pieces) {
  const OrganizedParams& params = fit.params();
  Sample all(surroundings);
  for (const TilePiece& piece : pieces) all.add(piece.quarter);
  const CellFits small = surroundings.fits(all.quarters, kSmallRadius);
  const auto around = [&](const TilePiece& piece) -> const CellFit& {
    return all.of(small, piece.quarter);
  };
  const double min_cosine = std::cos(params.coherent_angle);
  std::vector<Count> counts(planes.size());
  for (TilePiece& piece : pieces) {
    const auto label = static_cast<std::size_t>(piece.label);
    piece.near = planes[label].cosine(around(piece).normal) >= min_cosine;
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
  const auto isDoubtful = [&](const TilePiece& piece) {
    const Count& count = counts[static_cast<std::size_t>(piece.label)];
    return !piece.undecided && count.near < params.clear_coherent_fraction * count.all;
  };
  const auto error = [&](const TilePiece& piece) {
    return params.growing_factor * normalError(around(piece), fit.noise(), cloud.sensor, params);
  };
  const auto isNoisy = [&](const TilePiece& piece) {
    return isDoubtful(piece) && error(piece) > params.clear_normal_fraction * params.coherent_angle;
  };
  // Wide surroundings reach beyond the small planes that stand out of white noise: they do not
  // count against them.
  const bool white = fit.isWhite();
  Sample noisy(surroundings);
  for (const TilePiece& piece : pieces) {
    if (!white && isNoisy(piece)) noisy.add(piece.quarter);
  }
  const CellFits wide = surroundings.fits(noisy.quarters, kWideRadius);
  for (TilePiece& piece : pieces) {
    if (!isNoisy(piece)) continue;
    if (white) {
      piece.near = piece.wide = piece.agrees = true;
      continue;
    }
    const PlaneCandidate& plane = planes[static_cast<std::size_t>(piece.label)];
    piece.wide = plane.cosine(noisy.of(wide, piece.quarter).normal) >= min_cosine;
    piece.agrees = piece.near || piece.wide;
    if (piece.agrees) continue;
    const double allowed =
        std::min(params.most_coherent_angle, std::max(params.coherent_angle, error(piece)));
    piece.agrees = plane.cosine(around(piece).normal) >= std::cos(allowed);
  }
}

}  // namespace

void freeDisagreeing(const TiledCloud& cloud, const CellFits& windows,
                     const std::vector<PlaneCandidate>& planes, const MetricFit& fit,
                     PixelAssigner& pixels) {
  const OrganizedParams& params = fit.params();
  const std::vector<char> doubtful = doubtfulPlanes(planes, windows, params, pixels);
  std::vector<TilePiece> pieces = piecesOf(cloud, pixels, doubtful);
  if (pieces.empty()) return;
  Surroundings surroundings(cloud, params);
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
