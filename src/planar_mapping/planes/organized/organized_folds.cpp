// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/organized/metric_fit.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace planar_mapping::detail {
namespace {

/// The mean of a tile as seen from the sensor.
struct Sight {
  std::int32_t tile = 0;
  double place[2] = {0.0, 0.0};  ///< column, row
  Vector3 direction = Vector3::Zero();
  double inverse_range = 0.0;
  double weight = 0.0;  ///< one over the variance of inverse_range
};

/// Least squares of 1 / r = m . direction.
struct SightSums {
  Matrix3 squares = Matrix3::Zero();
  Vector3 products = Vector3::Zero();
  double constant = 0.0;

  void add(const Sight& sight) {
    squares += sight.weight * sight.direction * sight.direction.transpose();
    products += sight.weight * sight.inverse_range * sight.direction;
    constant += sight.weight * sight.inverse_range * sight.inverse_range;
  }
  void subtract(const SightSums& other) {
    squares -= other.squares;
    products -= other.products;
    constant -= other.constant;
  }
  Vector3 plane() const { return squares.inverse() * products; }
  double chiSquare(const Vector3& plane) const { return constant - plane.dot(products); }
};

/// The tiles of each plane where the noise blurs edges.
std::vector<std::vector<Sight>> sightsOf(const CellGrid& tiles, const MetricFit& fit,
                                         std::size_t planes,
                                         const std::vector<std::int16_t>& tile_labels) {
  std::vector<std::vector<Sight>> sights(planes);
  for (int tile = 0; tile < tiles.cells(); ++tile) {
    const std::int16_t label = tile_labels[static_cast<std::size_t>(tile)];
    const double n = tiles.count(tile);
    if (label < 0 || !(n > 0.0)) continue;
    const Vector3 ray = meanOf(tiles, tile) - fit.sensor();
    const double range = ray.norm();
    if (!(range > 0.0) || !fit.blursEdges(range * range)) continue;
    Sight sight;
    sight.tile = tile;
    sight.place[0] = tile % tiles.columns;
    sight.place[1] = tile / tiles.columns;
    sight.direction = ray / range;
    sight.inverse_range = 1.0 / range;
    const double sigma = fit.noise().at(range * range) * sight.inverse_range * sight.inverse_range;
    sight.weight = n / (sigma * sigma);
    sights[static_cast<std::size_t>(label)].push_back(sight);
  }
  return sights;
}

double angleBetween(const Vector3& m, const Vector3& other) {
  return std::atan2(m.cross(other).norm(), std::fabs(m.dot(other)));
}

/// Lists the sights of a region by their place across a line, at \p angle from the columns.
void sortAcross(const std::vector<Sight>& region, double angle, std::vector<std::size_t>& order) {
  constexpr double kSteps = 8.0;  // a tile
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  std::vector<int> places;
  places.reserve(region.size());
  for (const Sight& sight : region) {
    places.push_back(
        static_cast<int>(std::lround(kSteps * (c * sight.place[0] + s * sight.place[1]))));
  }
  const auto [low, high] = std::minmax_element(places.begin(), places.end());
  std::vector<std::size_t> first(static_cast<std::size_t>(*high - *low) + 2, 0);
  const int least = *low;
  for (const int place : places) ++first[static_cast<std::size_t>(place - least) + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  order.resize(region.size());
  for (std::size_t i = 0; i < region.size(); ++i) {
    order[first[static_cast<std::size_t>(places[i] - least)]++] = i;
  }
}

/// Cuts a region along the straight line in the image that gains most, if any gains enough.
/// \return the sights beyond it, which the region loses
std::vector<Sight> cutBest(std::vector<Sight>& region, const OrganizedParams& params) {
  constexpr int kOrientations = 8;
  constexpr std::size_t kMaxSteps = 64;  // over the sights of a region
  const auto least = static_cast<std::size_t>(kMinCells);
  if (region.size() < 2 * least) return {};
  SightSums all;
  for (const Sight& sight : region) all.add(sight);
  const double whole = all.chiSquare(all.plane());
  double most = params.fold_gain;
  if (whole < most) return {};  // no cut can gain that
  std::vector<std::size_t> order;
  std::vector<char> is_first;  // of each sight
  const std::size_t step = 1 + region.size() / kMaxSteps;
  for (int k = 0; k < kOrientations; ++k) {
    sortAcross(region, M_PI * k / kOrientations, order);
    SightSums first;
    std::size_t cut = 0;
    for (std::size_t i = 0; i + least < region.size(); ++i) {
      first.add(region[order[i]]);
      if (i + 1 < least || i % step != 0) continue;
      SightSums second = all;
      second.subtract(first);
      const Vector3 one = first.plane();
      const Vector3 other = second.plane();
      const double gain = whole - first.chiSquare(one) - second.chiSquare(other);
      if (!(gain > most) || !(angleBetween(one, other) > params.fold_angle)) continue;
      most = gain;
      cut = i + 1;
    }
    if (cut == 0) continue;
    is_first.assign(region.size(), 0);
    for (std::size_t i = 0; i < cut; ++i) is_first[order[i]] = 1;
  }
  if (is_first.empty()) return {};
  std::vector<Sight> kept;
  std::vector<Sight> beyond;
  for (std::size_t i = 0; i < region.size(); ++i) {
    (is_first[i] != 0 ? kept : beyond).push_back(region[i]);
  }
  region = std::move(kept);
  return beyond;
}

using Region = std::vector<Sight>;

/// The parts of a region.
std::vector<Region> cutAll(Region region, const OrganizedParams& params) {
  std::vector<Region> parts;
  parts.push_back(std::move(region));
  for (std::size_t i = 0; i < parts.size();) {
    Region beyond = cutBest(parts[i], params);
    if (beyond.empty()) {
      ++i;
    } else {
      parts.push_back(std::move(beyond));
    }
  }
  return parts;
}

}  // namespace

void cutFolds(const CellGrid& tiles, const MetricFit& fit, std::vector<PlaneCandidate>& planes,
              std::vector<std::int16_t>& tile_labels) {
  const OrganizedParams& params = fit.params();
  if (!fit.isWhite()) return;
  for (Region& region : sightsOf(tiles, fit, planes.size(), tile_labels)) {
    const std::vector<Region> parts = cutAll(std::move(region), params);
    for (std::size_t i = 1; i < parts.size() && planes.size() < kMaxCandidates; ++i) {
      for (const Sight& sight : parts[i]) {
        tile_labels[static_cast<std::size_t>(sight.tile)] =
            static_cast<std::int16_t>(planes.size());
      }
      planes.emplace_back();
    }
  }
}

bool isFold(const PlaneCandidate& one, const PlaneCandidate& other, const PlaneCandidate& joined,
            const MetricFit& fit) {
  if (std::acos(std::min(1.0, one.cosine(other.direction))) <= fit.params().fold_angle) {
    return false;
  }
  double gain = 0.0;
  for (const PlaneCandidate* side : {&one, &other}) {
    const Vector3 ray = meanOf(side->sums) - fit.sensor();
    if (!fit.blursEdges(ray.squaredNorm())) return false;
    const double sigma = fit.noise().at(ray.squaredNorm()) * std::fabs(side->height) / ray.norm();
    const double excess = joined.meanSquare(side->sums) - side->residual * side->residual;
    gain += side->sums[kN] * excess / (sigma * sigma);
  }
  return gain > fit.params().fold_gain;
}

}  // namespace planar_mapping::detail
