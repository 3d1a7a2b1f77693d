// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/from_features/surface_squares.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "planes/distance_band.h"

namespace planar_mapping::detail {
namespace {

/// Points beside planes are counted on about so many points of the cloud.
constexpr std::size_t kSample = 32768;
/// Squares farther from the middle of the cloud than this are all the same one.
constexpr double kFarSquare = 1e9;

/// A square of a plane.
struct Square {
  std::int64_t row = 0;
  std::int64_t column = 0;
  bool operator<(const Square& other) const {
    return row != other.row ? row < other.row : column < other.column;
  }
  bool operator==(const Square& other) const { return row == other.row && column == other.column; }
};

/// Squares of one plane.
class Squares {
 public:
  Squares(const Plane& plane, double side) : u_(plane.normal.unitOrthogonal() / side) {
    v_ = plane.normal.cross(u_);
  }
  Square at(const float* p) const {
    const Vector3 point(p[0], p[1], p[2]);
    return {place(v_.dot(point)), place(u_.dot(point))};
  }

 private:
  static std::int64_t place(double at) {
    return static_cast<std::int64_t>(std::floor(std::clamp(at, -kFarSquare, kFarSquare)));
  }
  Vector3 u_;
  Vector3 v_;
};

enum Place : std::uint8_t { kOn, kAbove, kBelow, kPlaces };

struct Sample {
  Square square;
  Place place = kOn;
};

/// The squares in which the plane holds a surface, ascending.
/// \param share gets the share of the sampled points on the plane that lie in them
std::vector<Square> surfaceSquares(const PointsView& points, const std::vector<std::size_t>& sample,
                                   const Plane& plane, const Squares& squares,
                                   const DistanceBand& band, double dominance, double& share) {
  std::vector<Sample> near;
  for (const std::size_t i : sample) {
    const float* p = points[i];
    const double distance =
        plane.normal[0] * p[0] + plane.normal[1] * p[1] + plane.normal[2] * p[2] + plane.offset;
    const double half = band.at(p[2]);
    if (!(std::fabs(distance) <= 3.0 * half)) continue;
    const Place place = std::fabs(distance) <= half ? kOn : (distance > 0.0 ? kAbove : kBelow);
    near.push_back({squares.at(p), place});
  }
  std::sort(near.begin(), near.end(),
            [](const Sample& a, const Sample& b) { return a.square < b.square; });
  std::vector<Square> good;
  std::size_t on_good = 0;
  std::size_t on_all = 0;
  for (std::size_t i = 0; i < near.size();) {
    std::array<std::size_t, kPlaces> count = {};
    const Square square = near[i].square;
    for (; i < near.size() && near[i].square == square; ++i) ++count[near[i].place];
    on_all += count[kOn];
    const auto beside = static_cast<double>(std::max(count[kAbove], count[kBelow]));
    if (count[kOn] > 0 && static_cast<double>(count[kOn]) >= dominance * beside) {
      good.push_back(square);
      on_good += count[kOn];
    }
  }
  share = on_all > 0 ? static_cast<double>(on_good) / static_cast<double>(on_all) : 0.0;
  return good;
}

/// Whether a square or one beside it (also diagonally) is in the list.
bool isAtSurface(const std::vector<Square>& good, const Square& square) {
  for (std::int64_t row = square.row - 1; row <= square.row + 1; ++row) {
    const auto next = std::lower_bound(good.begin(), good.end(), Square{row, square.column - 1});
    if (next != good.end() && next->row == row && next->column <= square.column + 1) return true;
  }
  return false;
}

}  // namespace

std::size_t keepSurfaces(const PointsView& points, const Indices& indices,
                         const std::vector<Plane>& planes, const MultiPlaneParams& params,
                         std::vector<std::int32_t>& labels) {
  const DistanceBand band(params);
  const std::size_t step = 1 + indices.size() / kSample;
  std::vector<std::size_t> sample;
  for (std::size_t k = 0; k < indices.size(); k += step) {
    const auto i = static_cast<std::size_t>(indices[k]);
    if (points.isFinite(i)) sample.push_back(i);
  }
  std::vector<Squares> squares;
  std::vector<std::vector<Square>> good(planes.size());
  std::size_t rejected = 0;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    squares.emplace_back(planes[k], params.features.square_side * params.distance_threshold);
    double share = 0.0;
    good[k] = surfaceSquares(points, sample, planes[k], squares[k], band,
                             params.features.square_dominance, share);
    if (share < params.features.min_surface_share) {
      good[k].clear();
      ++rejected;
    }
  }
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] < 0) continue;
    const auto k = static_cast<std::size_t>(labels[i]);
    // A square beside a good one may be cut by an edge, where the other surface stands beside it.
    if (good[k].empty() || !isAtSurface(good[k], squares[k].at(points[i]))) labels[i] = -1;
  }
  return rejected;
}

}  // namespace planar_mapping::detail
