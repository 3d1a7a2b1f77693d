// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/cloud_image.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/point_indices.h"
#include "planar_mapping/planes/tiles/organized_tiles.h"

namespace planar_mapping::detail {
namespace {

constexpr double kMaxOff = 0.1;         // steps that a value may be off the lattice
constexpr double kMaxSize = 10000.0;    // pixels a side
constexpr std::size_t kMinFilled = 10;  // one pixel of so many has a point, at least
// Most clouds are no image, as so many of their points show without a copy of all.
constexpr std::size_t kFirst = 4096;

/// Values start + k * step for whole k >= 0.
struct Lattice {
  double start = 0.0;
  double step = 0.0;
  std::vector<std::int32_t> places;  ///< k of each value
};

/// The lattice that all values lie on, by least squares, begun with a step that is off by less than
/// half a step over all of it. Its first place is at the same place of a tile as in an image whose
/// middle is the optical axis, as that of most cameras: planes near the limits depend on the tiles.
std::optional<Lattice> latticeOf(const std::vector<double>& values, double step) {
  Lattice lattice{values.front(), step, std::vector<std::int32_t>(values.size())};
  constexpr int kFits = 2;
  for (int fit = 0; fit <= kFits; ++fit) {
    double n = 0.0, k = 0.0, kk = 0.0, v = 0.0, kv = 0.0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double place = (values[i] - lattice.start) / lattice.step;
      const double whole = std::round(place);
      if (!(std::abs(whole) < kMaxSize) || !(std::abs(place - whole) < kMaxOff))
        return std::nullopt;
      lattice.places[i] = static_cast<std::int32_t>(whole);
      n += 1.0;
      k += whole;
      kk += whole * whole;
      v += values[i];
      kv += whole * values[i];
    }
    const double spread = n * kk - k * k;
    if (!(spread > 0.0)) return std::nullopt;
    lattice.step = (n * kv - k * v) / spread;
    lattice.start = (v - lattice.step * k) / n;
  }
  const auto [first, last] = std::minmax_element(lattice.places.begin(), lattice.places.end());
  const double axis = -lattice.start / lattice.step - *first;  // from the first place
  const double farthest = std::max(axis, *last - *first - axis);
  const double half = kTileSide * std::ceil(farthest / kTileSide);
  const auto before = static_cast<std::int32_t>(std::floor(half - axis)) % kTileSide;
  const std::int32_t move = (axis >= 0.0 ? before : 0) - *first;
  for (std::int32_t& place : lattice.places) place += move;
  return lattice;
}

/// Differences of neighbouring values that are one step, most of those that are listed.
double stepOf(std::vector<double>& differences) {
  return differences.empty() ? 0.0 : ranked(differences, differences.size() / 2);
}

/// The step between columns: most differences of neighbouring values.
double columnStepOf(const std::vector<double>& across) {
  std::vector<double> steps(across.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = across[i + 1] - across[i];
  return stepOf(steps);
}

}  // namespace

std::optional<CloudImage> imageOf(const PointsView& points, const Indices* indices) {
  CloudImage image;
  Indices used;
  std::vector<double> across, down;
  const std::size_t n = countOf(points, indices);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t index = at(indices, i);
    if (!points.isMeasured(index)) continue;
    const Vector3 p = points.point(index);
    if (!(p.z() > 0.0)) return std::nullopt;
    used.push_back(static_cast<int>(index));
    across.push_back(p.x() / p.z());
    down.push_back(p.y() / p.z());
    if (used.size() != kFirst) continue;
    const double step = columnStepOf(across);
    if (!(std::abs(step) > 0.0) || !latticeOf(across, step)) return std::nullopt;
  }
  if (used.size() < 2) return std::nullopt;
  const double column = columnStepOf(across);
  std::vector<double> rows;  // where x / z begins anew
  for (std::size_t i = 0; i + 1 < used.size(); ++i) {
    if ((across[i + 1] - across[i]) * column < 0.0) rows.push_back(down[i + 1] - down[i]);
  }
  const double row = stepOf(rows);
  if (!(std::abs(column) > 0.0) || !(std::abs(row) > 0.0)) return std::nullopt;
  const std::optional<Lattice> columns = latticeOf(across, column);
  if (!columns) return std::nullopt;
  const std::optional<Lattice> lines = latticeOf(down, row);
  if (!lines) return std::nullopt;

  const auto sizeOf = [](const Lattice& lattice) {
    return 1U + static_cast<std::uint32_t>(
                    *std::max_element(lattice.places.begin(), lattice.places.end()));
  };
  image.width = sizeOf(*columns);
  image.height = sizeOf(*lines);
  const std::size_t size = std::size_t{image.width} * image.height;
  if (size > kMinFilled * used.size()) return std::nullopt;
  image.xyz.assign(3 * size, std::numeric_limits<float>::quiet_NaN());
  image.points.assign(size, -1);
  for (std::size_t i = 0; i < used.size(); ++i) {
    const std::size_t pixel = static_cast<std::size_t>(lines->places[i]) * image.width +
                              static_cast<std::size_t>(columns->places[i]);
    if (image.points[pixel] >= 0) return std::nullopt;
    image.points[pixel] = used[i];
    const float* p = points[static_cast<std::size_t>(used[i])];
    std::copy(p, p + 3, image.xyz.begin() + static_cast<std::ptrdiff_t>(3 * pixel));
  }
  for (std::size_t pixel = 0; pixel < size; ++pixel) {
    if (image.points[pixel] >= 0) image.pixels.push_back(static_cast<int>(pixel));
  }
  return image;
}

}  // namespace planar_mapping::detail
