// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "planar_mapping/ground/ground_model.h"

namespace planar_mapping::detail {
namespace {

constexpr int kCells = GroundBends::kCells;
constexpr double kWeightUnseen = 0.05;

/// The local ground of a cell: w = c + a u + b v, u and v from the cell's centre.
struct Piece {
  double a = 0.0;
  double b = 0.0;
  double c = 0.0;
  double at(double u, double v) const { return c + a * u + b * v; }
};

struct CellPoint {
  float u, v, w, band;
};

int scoreOf(const CellPoint* points, std::size_t n, const Piece& piece) {
  int score = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double d = points[i].w - piece.at(points[i].u, points[i].v);
    // What lies below the band speaks against a surface as much as what lies in it speaks for it.
    score += std::abs(d) <= points[i].band ? 1 : (d < 0.0 ? -1 : 0);
  }
  return score;
}

/// Points that stand on a piece: on a slope nothing does, but over the foot of a low step.
int standingOn(const CellPoint* points, std::size_t n, const Piece& piece) {
  constexpr double kLow = 0.3;  // metres: what is higher was taken out
  return static_cast<int>(std::count_if(points, points + n, [&](const CellPoint& point) {
    const double d = point.w - piece.at(point.u, point.v);
    return d > point.band && d < kLow;
  }));
}

/// Least squares on the points within the window around \p prior, which also holds where there
/// are too few of them.
Piece fitAround(const CellPoint* points, std::size_t n, const Piece& prior, double extra_window,
                double slope_deviation) {
  const double band = n > 0 ? points[0].band : 1.0;
  const double stiffness = 1.0 / (slope_deviation * slope_deviation);
  double uu = stiffness, uv = 0.0, vv = stiffness, u1 = 0.0, v1 = 0.0, one = 1.0 / (band * band);
  double ud = 0.0, vd = 0.0, sum_d = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double u = points[i].u;
    const double v = points[i].v;
    const double d = points[i].w - prior.at(u, v);
    if (!(std::abs(d) <= points[i].band + extra_window)) continue;
    const double weight = 1.0 / (double(points[i].band) * points[i].band);
    uu += weight * u * u;
    uv += weight * u * v;
    vv += weight * v * v;
    u1 += weight * u;
    v1 += weight * v;
    one += weight;
    ud += weight * u * d;
    vd += weight * v * d;
    sum_d += weight * d;
  }
  Matrix3 information;
  information << uu, uv, u1, uv, vv, v1, u1, v1, one;
  const Vector3 right(ud, vd, sum_d);
  const Vector3 change = information.ldlt().solve(right);
  return {prior.a + change[0], prior.b + change[1], prior.c + change[2]};
}

/// All cells by their distance from the sensor, in the middle of the grid.
const std::vector<std::int32_t>& outwards() {
  static const std::vector<std::int32_t> order = [] {
    std::vector<std::int32_t> cells(kCells * kCells);
    std::iota(cells.begin(), cells.end(), 0);
    const auto squaredRange = [](std::int32_t cell) {
      const int a = 2 * (cell % kCells) + 1 - kCells;
      const int b = 2 * (cell / kCells) + 1 - kCells;
      return a * a + b * b;
    };
    std::stable_sort(cells.begin(), cells.end(), [&](std::int32_t p, std::int32_t q) {
      return squaredRange(p) < squaredRange(q);
    });
    return cells;
  }();
  return order;
}

}  // namespace

GroundBends::GroundBends(const GroundSample& sample, const GroundEstimate& estimate,
                         const GroundParams& params, const GroundFrame& frame) {
  if (params.slope_cell == 0.0) return;
  const double side = params.slope_cell;
  const GroundPlane& plane = estimate.plane;
  const double cosine = plane.cosine();
  const double height = plane.height();
  origin = static_cast<float>(-0.5 * kCells * side);
  cells_per_metre = static_cast<float>(1.0 / side);

  // Sample points by cell.
  std::vector<std::int32_t> cell_of(sample.size(), -1);
  std::vector<std::size_t> first(kCells * kCells + 1, 0);
  for (std::size_t i = 0; i < sample.size(); ++i) {
    const float a = (sample.x[i] - origin) * cells_per_metre;
    const float b = (sample.y[i] - origin) * cells_per_metre;
    if (!(a >= 0.0f && b >= 0.0f && a < kCells && b < kCells)) continue;
    cell_of[i] = static_cast<int>(b) * kCells + static_cast<int>(a);
    ++first[static_cast<std::size_t>(cell_of[i]) + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<CellPoint> points(first.back());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  const auto centerOf = [&](int index) { return (index + 0.5 - 0.5 * kCells) * side; };
  for (std::size_t i = 0; i < sample.size(); ++i) {
    if (cell_of[i] < 0) continue;
    const double w =
        (sample.z[i] - plane.slope_x * sample.x[i] - plane.slope_y * sample.y[i] - plane.offset) *
        cosine;
    points[next[cell_of[i]]++] = {static_cast<float>(sample.x[i] - centerOf(cell_of[i] % kCells)),
                                  static_cast<float>(sample.y[i] - centerOf(cell_of[i] / kCells)),
                                  static_cast<float>(w),
                                  static_cast<float>(frame.band(sample.depth[i], height))};
  }

  // Outwards from the sensor, each cell starts from those before it.
  const double steepest = std::tan(params.max_slope);
  std::vector<Piece> local(kCells * kCells);
  std::vector<std::uint8_t> done(local.size(), 0);
  for (const std::int32_t cell : outwards()) {
    const int a = cell % kCells;
    const int b = cell / kCells;
    Piece predicted;
    double towards_u = 0.0;
    double towards_v = 0.0;
    double weights = 0.0;
    for (int db = -1; db <= 1; ++db) {
      for (int da = -1; da <= 1; ++da) {
        if (a + da < 0 || b + db < 0 || a + da >= kCells || b + db >= kCells) continue;
        const std::int32_t other = cell + db * kCells + da;
        if (!done[other]) continue;
        const Piece& piece = local[other];
        // Cells without points only carry on what they were given.
        const double weight = first[other + 1] > first[other] ? 1.0 : kWeightUnseen;
        predicted.a += weight * piece.a;
        predicted.b += weight * piece.b;
        predicted.c += weight * piece.at(-da * side, -db * side);
        towards_u += weight * 0.5 * da * side;
        towards_v += weight * 0.5 * db * side;
        weights += weight;
      }
    }
    if (weights > 0.0) {
      predicted = {predicted.a / weights, predicted.b / weights, predicted.c / weights};
      towards_u /= weights;
      towards_v /= weights;
    }
    done[cell] = 1;
    Piece& piece = local[cell];
    const CellPoint* own = points.data() + first[cell];
    const std::size_t n = first[cell + 1] - first[cell];
    if (n == 0) {
      // Out of sight a slope is not carried on for long.
      piece = {0.5 * predicted.a, 0.5 * predicted.b, predicted.c};
      continue;
    }
    ++followed;
    piece = predicted;
    int best = scoreOf(own, n, predicted);
    // A cell before it that went astray must not take this one along where the plane at the sensor
    // still holds.
    const int flat = scoreOf(own, n, Piece());
    if (flat > best) {
      piece = Piece();
      best = flat;
    }
    const Piece narrow = fitAround(own, n, predicted, 0.0, 0.25 * steepest);
    const auto tooSteep = [&](const Piece& p) { return std::hypot(p.a, p.b) > steepest; };
    if (!tooSteep(narrow)) {
      const int score = scoreOf(own, n, narrow);
      if (score > 0 && score >= best) {
        piece = narrow;
        best = score;
      }
    }
    if (10 * best >= 9 * static_cast<int>(n)) continue;
    Piece wide = fitAround(own, n, predicted, 0.5 * side * steepest, steepest);
    wide = fitAround(own, n, wide, 0.0, steepest);
    // A slope meets what is before it, at the border or somewhere in the cell before; a kerb does
    // not.
    const auto stepAt = [&](double fraction) {
      return wide.at(fraction * towards_u, fraction * towards_v) -
             predicted.at(fraction * towards_u, fraction * towards_v);
    };
    const double at_border = stepAt(1.0);
    const double beyond = stepAt(3.0);
    const bool meets = std::min(std::abs(at_border), std::abs(beyond)) <= own[0].band ||
                       (at_border < 0.0) != (beyond < 0.0);
    if (meets && !tooSteep(wide)) {
      const int score = scoreOf(own, n, wide) - standingOn(own, n, wide);
      if (score > best + 2 + static_cast<int>(n) / 10) piece = wide;
    }
  }

  pieces.resize(3 * kSide * kSide, 0.0f);
  for (std::int32_t cell = 0; cell < kCells * kCells; ++cell) {
    const Piece& piece = local[cell];
    const double u = centerOf(cell % kCells);
    const double v = centerOf(cell / kCells);
    float* out = pieces.data() + 3 * ((cell / kCells + 1) * kSide + cell % kCells + 1);
    out[0] = static_cast<float>(piece.at(-u, -v));
    out[1] = static_cast<float>(piece.a);
    out[2] = static_cast<float>(piece.b);
  }
}

}  // namespace planar_mapping::detail
