// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/export/floors.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/geometry/oriented_box.h"
#include "planar_mapping/io/export/exported_map.h"

namespace planar_mapping::io {
namespace {

constexpr double kExcess = 0.025;  // metres: faces are thicker than surfaces
constexpr double kMinCell = 0.02;  // metres

}  // namespace

double lengthInside(const Matrix3& to_local, const Cuboid& cuboid, const Vector2& at, double low,
                    double high) {
  const Vector3 from = to_local * (Vector3(at.x(), at.y(), 0.0) - cuboid.center);
  const Vector3 half = 0.5 * cuboid.size;
  Vector3 along = to_local.col(2);
  for (double& a : along) a = std::abs(a) < 1e-12 ? 0.0 : a;
  return detail::clipToBox(-half, half, from, along, low, high) ? high - low : 0.0;
}

Floors::Floors(const std::vector<Cuboid>& cuboids, const std::vector<Cuboid>& free,
               const GroundHeights& ground, double low, double cell)
    : is_floor_(cuboids.size(), 0) {
  constexpr double kMaxCells = 2e7;
  raster_.cell = std::max(cell, kMinCell);
  Vector2 from = Vector2::Constant(INFINITY), to = -from;
  for (const Cuboid& cuboid : cuboids) {
    if (!isLevel(cuboid, Vector3::UnitZ())) continue;
    const Vector2 reach = detail::OrientedBox(cuboid).reach().head<2>();
    from = from.cwiseMin(cuboid.center.head<2>() - reach);
    to = to.cwiseMax(cuboid.center.head<2>() + reach);
  }
  if (!from.allFinite()) return;
  raster_.cell *=
      std::ceil(std::max(1.0, std::sqrt((to - from).prod() / kMaxCells) / raster_.cell));
  raster_.origin = raster_.cell * (from / raster_.cell - Vector2::Ones()).array().floor();
  raster_.size = ((to - raster_.origin) / raster_.cell).array().cast<int>() + 2;
  for (const Cuboid& cuboid : cuboids) plane_of_.push_back(cuboid.plane_id);
  sampleFaces(cuboids);
  measureBelow(free);
  findFloor(ground, low);
}

/// Cells with their middles within a radius; the rim of the raster is empty.
template <typename Visit>
void Floors::forNeighbours(std::size_t cell, double radius, const Visit& visit) const {
  const int reach = static_cast<int>(radius / raster_.cell);
  const Eigen::Array2i place = raster_.placeOf(cell);
  raster_.forCells(place - reach, place + reach, [&](const Eigen::Array2i& at) {
    if (raster_.cell * std::hypot(at.x() - place.x(), at.y() - place.y()) <= radius)
      visit(raster_.numberOf(at));
  });
}

void Floors::sampleFaces(const std::vector<Cuboid>& cuboids) {
  std::vector<std::pair<std::size_t, Sample>> found;  // cell, sample
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    const Cuboid& cuboid = cuboids[i];
    if (!isLevel(cuboid, Vector3::UnitZ())) continue;
    const Matrix3 axes = cuboid.orientation.toRotationMatrix();
    // Rectangles that are at most a cell apart have samples in cells next to each other.
    const Vector3 half = 0.5 * cuboid.size + Vector3::Constant(0.5 * raster_.cell);
    const Vector2 reach = detail::OrientedBox(cuboid).reach().head<2>();
    const Vector2 rim = Vector2::Constant(0.5 * raster_.cell);
    raster_.forCellsAround(
        cuboid.center.head<2>(), reach + rim, [&](std::size_t cell, const Vector2& at) {
          Vector3 offset(at.x() - cuboid.center.x(), at.y() - cuboid.center.y(), 0.0);
          offset.z() = -axes.col(2).head<2>().dot(offset.head<2>()) / axes(2, 2);
          const Vector3 local = axes.transpose() * offset;
          if (std::abs(local.x()) > half.x() || std::abs(local.y()) > half.y()) return;
          const double top = cuboid.center.z() + offset.z() + 0.5 * cuboid.size.z();
          Sample sample{static_cast<float>(top - kExcess), static_cast<std::uint32_t>(i)};
          sample.is_inside = std::abs(local.x()) <= 0.5 * cuboid.size.x() &&
                             std::abs(local.y()) <= 0.5 * cuboid.size.y();
          found.emplace_back(cell, sample);
        });
  }
  first_.assign(raster_.count() + 1, 0);
  for (const auto& [cell, sample] : found) ++first_[cell + 1];
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  samples_.resize(found.size());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (const auto& [cell, sample] : found) samples_[next[cell]++] = sample;
}

void Floors::measureBelow(const std::vector<Cuboid>& free) {
  const DepthBelow below(raster_.cell);
  for (const Cuboid& cuboid : free) {
    const Matrix3 to_local = cuboid.orientation.conjugate().toRotationMatrix();
    const Vector2 reach = detail::OrientedBox(cuboid).reach().head<2>();
    raster_.forCellsAround(
        cuboid.center.head<2>(), reach, [&](std::size_t cell, const Vector2& at) {
          for (std::uint32_t k = first_[cell]; k < first_[cell + 1]; ++k) {
            Sample& sample = samples_[k];
            sample.free_below += static_cast<float>(lengthInside(
                to_local, cuboid, at, sample.height - below.to, sample.height - below.from));
          }
        });
  }
}

void Floors::findFloor(const GroundHeights& ground, double low) {
  constexpr double kMaxStep = 0.12;  // metres, less than the usual lower end of a band
  constexpr double kRadius = 0.25;   // metres, of a robot
  constexpr double kSeam = 0.05;     // metres, between two planes
  constexpr double kFilled = 0.9;    // of the cells that it covers
  const double step = std::min(kMaxStep, low);
  const double apart = 1.5 * raster_.cell;  // of cells next to each other
  const DepthBelow below(raster_.cell);
  std::vector<std::pair<std::size_t, std::uint32_t>> queue;  // cell, sample
  const auto forCells = [&](const auto& visit) {
    for (std::size_t cell = 0; cell + 1 < first_.size(); ++cell)
      for (std::uint32_t k = first_[cell]; k < first_[cell + 1]; ++k) visit(cell, k);
  };
  const auto forReached = [&](std::size_t cell, std::uint32_t from, double radius,
                              const auto& visit) {
    const Sample& source = samples_[from];
    forNeighbours(cell, radius, [&](std::size_t other) {
      for (std::uint32_t k = first_[other]; k < first_[other + 1]; ++k) {
        const Sample& sample = samples_[k];
        // Noise over the ground is no step up to what is higher.
        const bool is_reached =
            plane_of_[sample.cuboid] == plane_of_[source.cuboid] || sample.height <= source.highest;
        if (is_reached && std::abs(sample.height - source.height) <= step) visit(other, k);
      }
    });
  };
  std::vector<double> off;
  forCells([&](std::size_t cell, std::uint32_t k) {
    Sample& sample = samples_[k];
    const Vector2 at = raster_.middleOf(raster_.placeOf(cell));
    const double over = sample.height - ground.at({at.x(), at.y(), 0.0});
    sample.is_level = over <= low && over >= -kMaxStep;
    const double from = sample.is_level ? std::min(over, 0.0) - over : 0.0;
    sample.highest = static_cast<float>(sample.height + from + step + kExcess);
    if (std::abs(over + kExcess) <= kMaxStep) off.push_back(over);
    if (!sample.is_level && sample.free_below >= below.enough) return;
    std::size_t all = 0, filled = 0;
    forNeighbours(cell, kRadius, [&](std::size_t other) {
      ++all;
      for (std::uint32_t i = first_[other]; i < first_[other + 1]; ++i) {
        const bool is_same = plane_of_[samples_[i].cuboid] == plane_of_[sample.cuboid];
        if (std::abs(samples_[i].height - sample.height) > (is_same ? step : std::min(step, kSeam)))
          continue;
        ++filled;
        break;
      }
    });
    sample.is_wide = static_cast<double>(filled) >= kFilled * static_cast<double>(all);
    sample.is_floor = sample.is_level || (sample.is_wide && over < 0.0);
    if (sample.is_floor && sample.is_wide) queue.emplace_back(cell, k);
  });
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const auto [from_cell, from] = queue[i];
    forReached(from_cell, from, apart, [&](std::size_t cell, std::uint32_t k) {
      if (samples_[k].is_floor || !samples_[k].is_wide) return;
      samples_[k].is_floor = true;
      queue.emplace_back(cell, k);
    });
  }
  for (const auto& [cell, from] : queue) {
    forReached(cell, from, kRadius, [&](std::size_t, std::uint32_t k) {
      if (samples_[k].free_below < below.enough) samples_[k].is_floor = true;
    });
  }
  std::vector<std::pair<int, int>> counts(is_floor_.size(), {0, 0});  // all, floor
  for (const Sample& sample : samples_) {
    ++counts[sample.cuboid].first;
    counts[sample.cuboid].second += sample.is_floor ? 1 : 0;
  }
  for (std::size_t i = 0; i < counts.size(); ++i)
    is_floor_[i] = counts[i].first > 0 && 2 * counts[i].second > counts[i].first ? 1 : 0;
  if (off.empty() || ground.lowest() < ground.highest()) return;
  raise_ = -detail::ranked(off, off.size() / 2);
}

std::optional<Floors::Place> Floors::at(const Vector2& place, double near) const {
  constexpr double kMost = 1.0;  // metres: not another storey
  const Eigen::Array2d cell = ((place - raster_.origin) / raster_.cell).array();
  if ((cell < 0.0).any() || (cell >= raster_.size.cast<double>()).any()) return std::nullopt;
  const std::size_t i = raster_.numberOf(cell.cast<int>());
  const Sample* found = nullptr;
  bool is_inside = false;
  for (std::uint32_t k = first_[i]; k < first_[i + 1]; ++k) {
    const Sample& sample = samples_[k];
    if (!sample.is_floor || std::abs(sample.height + raise_ - near) > kMost) continue;
    is_inside = is_inside || sample.is_inside;
    const bool is_noise = found != nullptr && found->is_level && sample.is_level;  // or found is
    if (found == nullptr || (sample.height > found->height) != is_noise) found = &sample;
  }
  if (found == nullptr) return std::nullopt;
  return Place{found->height + raise_, is_inside};
}

std::vector<GroundPoint> Floors::ground() const {
  constexpr double kSide = 2.0;       // metres, as of PlanarMap::ground()
  constexpr float kSameFloor = 0.3f;  // metres
  constexpr double kFraction = 0.3;   // of the largest of several floors over each other
  std::map<std::pair<int, int>, std::vector<float>> places;
  for (std::size_t cell = 0; cell + 1 < first_.size(); ++cell) {
    for (std::uint32_t k = first_[cell]; k < first_[cell + 1]; ++k) {
      if (!samples_[k].is_floor) continue;
      const Vector2 at = raster_.middleOf(raster_.placeOf(cell));
      places[{static_cast<int>(std::floor(at.x() / kSide)),
              static_cast<int>(std::floor(at.y() / kSide))}]
          .push_back(samples_[k].height);
    }
  }
  std::vector<GroundPoint> points;
  for (auto& [place, heights] : places) {
    std::sort(heights.begin(), heights.end());
    const auto endOf = [&](auto first) {
      return std::upper_bound(first, heights.end(), *first + kSameFloor);
    };
    std::ptrdiff_t most = 0;
    for (auto i = heights.begin(); i != heights.end(); ++i) most = std::max(most, endOf(i) - i);
    auto first = heights.begin();
    while (static_cast<double>(endOf(first) - first) < kFraction * static_cast<double>(most))
      ++first;
    const std::ptrdiff_t count = endOf(first) - first;
    const double height = std::accumulate(first, first + count, 0.0) / static_cast<double>(count);
    points.push_back(
        {Vector3((place.first + 0.5) * kSide, (place.second + 0.5) * kSide, height + raise_),
         static_cast<std::uint32_t>(count)});
  }
  return points;
}

}  // namespace planar_mapping::io
