// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/occupancy_grid.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "export/exported_map.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/geometry/detail/oriented_box.h"

namespace planar_mapping::io {
namespace {

constexpr double kMaxCells = 5e7;
constexpr double kFreeFraction = 0.75;  ///< of a column: a robot has to fit

Cuboid turned(const Quaternion& turn, Cuboid cuboid) {
  cuboid.center = turn * cuboid.center;
  cuboid.orientation = turn * cuboid.orientation;
  return cuboid;
}

/// Cells from first to last, both included.
struct Range {
  int first, last;
};

/// The grid while it is made; low and high are the heights of the band over the ground.
struct Columns {
  OccupancyGrid grid;
  GroundHeights ground;
  double low, high;

  Columns(GroundHeights heights, const GridBand& band)
      : ground(std::move(heights)), low(band.low), high(band.high) {}

  double groundAt(const Vector2& at) const { return ground.at({at.x(), at.y(), 0.0}); }

  Range range(double from, double to, double origin, std::uint32_t count) const {
    const double last = static_cast<double>(count) - 1.0;
    return {static_cast<int>(std::clamp(std::floor((from - origin) / grid.cell), 0.0, last)),
            static_cast<int>(std::clamp(std::floor((to - origin) / grid.cell), 0.0, last))};
  }
  template <typename Visit>
  void forEachCellBelow(const Cuboid& cuboid, const Vector3& reach, Visit&& visit) const {
    const Vector3& c = cuboid.center;
    const Range x = range(c.x() - reach.x(), c.x() + reach.x(), grid.origin.x(), grid.width);
    const Range y = range(c.y() - reach.y(), c.y() + reach.y(), grid.origin.y(), grid.height);
    for (int j = y.first; j <= y.last; ++j) {
      for (int i = x.first; i <= x.last; ++i) {
        visit(static_cast<std::size_t>(j) * grid.width + static_cast<std::size_t>(i),
              grid.origin + grid.cell * Vector2(i + 0.5, j + 0.5));
      }
    }
  }
};

/// How much of the vertical line through a point is in the cuboid, between two heights.
double lengthInside(const Matrix3& to_local, const Cuboid& cuboid, const Vector2& at, double low,
                    double high) {
  const Vector3 from = to_local * (Vector3(at.x(), at.y(), 0.0) - cuboid.center);
  const Vector3 half = 0.5 * cuboid.size;
  Vector3 along = to_local.col(2);
  for (double& a : along) a = std::abs(a) < 1e-12 ? 0.0 : a;
  return detail::clipToBox(-half, half, from, along, low, high) ? high - low : 0.0;
}

/// A level face as seen from above, in axes whose third is upwards.
struct Level {
  Vector3 center, normal;
  Vector2 low, high;
  double heightAt(const Vector2& at) const {
    const Vector2 slope = normal.head<2>() / normal.z();
    return center.z() - slope.dot(at - center.head<2>());
  }
  /// Whether a robot gets from one to the other without a step.
  bool meets(const Level& other) const {
    constexpr double kGap = 0.5;    // metres
    constexpr double kStep = 0.12;  // metres, less than the usual lower end of a band
    const Vector2 here = other.center.head<2>().cwiseMax(low).cwiseMin(high);
    const Vector2 there = here.cwiseMax(other.low).cwiseMin(other.high);
    const Vector2 back = there.cwiseMax(low).cwiseMin(high);
    return (there - back).norm() <= kGap &&
           std::abs(heightAt(back) - other.heightAt(there)) <= kStep;
  }
};

/// Makes room for all that lies in the band.
void placeGrid(const std::vector<Cuboid>& cuboids, const std::vector<Cuboid>& free,
               Columns& columns) {
  Vector2 low = Vector2::Constant(INFINITY), high = -low;
  for (const std::vector<Cuboid>* list : {&cuboids, &free}) {
    for (const Cuboid& cuboid : *list) {
      const Vector3 reach = detail::OrientedBox(cuboid).reach();
      if (cuboid.center.z() + reach.z() <= columns.ground.lowest() + columns.low ||
          cuboid.center.z() - reach.z() >= columns.ground.highest() + columns.high) {
        continue;
      }
      low = low.cwiseMin((cuboid.center - reach).head<2>());
      high = high.cwiseMax((cuboid.center + reach).head<2>());
    }
  }
  if (!low.allFinite()) low = high = Vector2::Zero();
  OccupancyGrid& grid = columns.grid;
  // What ends on a line between two cells, but for rounding, does not reach the next one.
  const Vector2 first = (low / grid.cell).array() + 1e-6, last = (high / grid.cell).array() - 1e-6;
  const Vector2 begin = first.array().floor();
  const Vector2 count = (last.array().ceil() - begin.array()).max(1.0);
  if (!(count.prod() <= kMaxCells)) {
    const double smallest = grid.cell * std::sqrt(count.prod() / kMaxCells);
    throw ParameterError("cells of " + std::to_string(grid.cell) +
                         " m make a grid of more than 50 million; take at least --cell " +
                         std::to_string(1.1 * smallest));
  }
  grid.origin = grid.cell * begin;
  grid.width = static_cast<std::uint32_t>(count.x());
  grid.height = static_cast<std::uint32_t>(count.y());
}

}  // namespace

std::vector<std::uint8_t> floorFaces(const std::vector<Cuboid>& cuboids, const Vector3& up,
                                     const GroundHeights& ground, double low) {
  constexpr double kTile = 4.0;       // metres
  constexpr double kFoothold = 0.25;  // metres
  const Quaternion turn = turning(up, Vector3::UnitZ());
  std::vector<Level> levels;
  std::vector<std::size_t> cuboid_of;
  std::map<std::pair<int, int>, std::vector<std::size_t>> tiles;
  const auto forTiles = [&](const Level& level, const auto& visit) {
    const Vector2 first = ((level.low.array() - 0.5) / kTile).floor();
    const Vector2 last = ((level.high.array() + 0.5) / kTile).floor();
    for (double x = first.x(); x <= last.x(); ++x)
      for (double y = first.y(); y <= last.y(); ++y)
        visit(std::make_pair(static_cast<int>(x), static_cast<int>(y)));
  };
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    if (!isLevel(cuboids[i], up)) continue;
    const Cuboid cuboid = turned(turn, cuboids[i]);
    const Vector2 reach = detail::OrientedBox(cuboid).reach().head<2>();
    const Vector2 center = cuboid.center.head<2>();
    levels.push_back(
        {cuboid.center, cuboid.orientation * Vector3::UnitZ(), center - reach, center + reach});
    cuboid_of.push_back(i);
    forTiles(levels.back(), [&](const auto& tile) { tiles[tile].push_back(levels.size() - 1); });
  }
  std::vector<std::uint8_t> is_floor(cuboids.size(), 0);
  std::vector<std::size_t> queue;
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const Cuboid& cuboid = cuboids[cuboid_of[k]];
    if (cuboid.center.dot(up) + 0.5 * cuboid.size.z() > ground.at(cuboid.center) + low) continue;
    is_floor[cuboid_of[k]] = 1;
    queue.push_back(k);
  }
  while (!queue.empty()) {
    const std::size_t k = queue.back();
    queue.pop_back();
    // What lies on the face of a kerb is no ramp.
    if (cuboids[cuboid_of[k]].size.head<2>().minCoeff() < kFoothold) continue;
    forTiles(levels[k], [&](const auto& tile) {
      for (const std::size_t other : tiles[tile]) {
        if (is_floor[cuboid_of[other]] != 0 || !levels[k].meets(levels[other])) continue;
        is_floor[cuboid_of[other]] = 1;
        queue.push_back(other);
      }
    });
  }
  return is_floor;
}

std::vector<GroundPoint> floorPoints(const std::vector<Cuboid>& cuboids, const Vector3& up,
                                     double ground) {
  constexpr double kSide = 2.0;       // metres, as of PlanarMap::ground()
  constexpr double kStep = 0.25;      // metres between samples of a face
  constexpr double kMost = 300.0;     // of them along a side
  constexpr float kSameFloor = 0.3f;  // metres
  constexpr double kFraction = 0.3;   // of the largest of several floors over each other
  constexpr double kLevel = 0.1;      // metres
  const std::vector<std::uint8_t> is_floor =
      floorFaces(cuboids, up, GroundHeights(ground), GridBand().low);
  const Quaternion turn = turning(up, Vector3::UnitZ());
  std::map<std::pair<int, int>, std::vector<float>> places;
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    if (is_floor[i] == 0) continue;
    const Cuboid cuboid = turned(turn, cuboids[i]);
    const Matrix3 axes = cuboid.orientation.toRotationMatrix();
    const Vector3 half = 0.5 * cuboid.size;
    const Vector3 top = topOf(cuboid, Vector3::UnitZ());
    const double apart = std::max(kStep, cuboid.size.head<2>().maxCoeff() / kMost);
    for (double u = 0.5 * apart; u < cuboid.size.x(); u += apart) {
      for (double v = 0.5 * apart; v < cuboid.size.y(); v += apart) {
        const Vector3 p = top + (u - half.x()) * axes.col(0) + (v - half.y()) * axes.col(1);
        places[{static_cast<int>(std::floor(p.x() / kSide)),
                static_cast<int>(std::floor(p.y() / kSide))}]
            .push_back(static_cast<float>(p.z()));
      }
    }
  }
  std::vector<GroundPoint> points;
  std::vector<double> off;  // of places at the height of the ground
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
    if (std::abs(height - ground) <= kLevel) off.push_back(height - ground);
    points.push_back({turn.conjugate() * Vector3((place.first + 0.5) * kSide,
                                                 (place.second + 0.5) * kSide, height),
                      static_cast<std::uint32_t>(count)});
  }
  if (off.empty()) return points;
  // Upper faces are above the surface by what noise made them thicker.
  const auto half = off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2);
  std::nth_element(off.begin(), half, off.end());
  for (GroundPoint& point : points) point.position -= *half * up;
  return points;
}

OccupancyGrid gridOf(const ExportedMap& map) {
  const GridBand& band = map.options.band;
  requireInRange("band low", band.low, -1e6, 1e6, "m");
  requireInRange("band high", band.high, -1e6, 1e6, "m");
  if (!(band.low < band.high)) throw ParameterError("a band must end above its beginning");
  const Quaternion turn = turning(map.up, Vector3::UnitZ());
  std::vector<Cuboid> cuboids, free;
  for (const Cuboid& cuboid : map.cuboids) cuboids.push_back(turned(turn, cuboid));
  for (const Cuboid& cuboid : map.free) free.push_back(turned(turn, cuboid));

  std::vector<GroundPoint> ground;
  for (const GroundPoint& point : map.ground)
    ground.push_back({turn * point.position, point.points});
  double height = band.ground;
  if (std::isnan(height)) {
    height = groundHeight(map.cuboids, map.up, map.sensors);
    if (ground.empty()) ground = floorPoints(cuboids, Vector3::UnitZ(), height);
  } else {
    ground.clear();
  }
  Columns columns(GroundHeights(ground, Vector3::UnitZ(), height), band);
  OccupancyGrid& grid = columns.grid;
  grid.cell = map.cell();
  grid.ground = columns.ground.middle();
  requireInRange("ground", grid.ground, -1e6, 1e6, "m");
  placeGrid(cuboids, free, columns);
  const std::size_t count = std::size_t{grid.width} * grid.height;

  std::vector<float> seen(count, 0.0f);  // height that was seen free
  for (const Cuboid& cuboid : free) {
    const Matrix3 to_local = cuboid.orientation.conjugate().toRotationMatrix();
    columns.forEachCellBelow(
        cuboid, detail::OrientedBox(cuboid).reach(), [&](std::size_t i, const Vector2& at) {
          const double height = columns.groundAt(at);
          seen[i] += static_cast<float>(
              lengthInside(to_local, cuboid, at, height + band.low, height + band.high));
        });
  }
  const auto enough = static_cast<float>(kFreeFraction * (band.high - band.low));
  grid.values.assign(count, OccupancyGrid::kUnknown);
  for (std::size_t i = 0; i < count; ++i) {
    if (seen[i] >= enough * (1.0f - 1e-5f)) grid.values[i] = OccupancyGrid::kFree;
  }
  const Vector3 half = (1.0 - 1e-6) * 0.5 * Vector3(grid.cell, grid.cell, band.high - band.low);
  const std::vector<std::uint8_t> is_floor =
      band.low > 0.0 ? floorFaces(cuboids, Vector3::UnitZ(), columns.ground, band.low)
                     : std::vector<std::uint8_t>(cuboids.size(), 0);
  for (std::size_t c = 0; c < cuboids.size(); ++c) {
    const Cuboid& cuboid = cuboids[c];
    if (cuboid.state != CellState::Occupied || is_floor[c] != 0) continue;
    const detail::OrientedBox box(cuboid);
    columns.forEachCellBelow(cuboid, box.reach(), [&](std::size_t i, const Vector2& at) {
      const double middle = columns.groundAt(at) + 0.5 * (band.low + band.high);
      if (box.meets({at.x(), at.y(), middle}, half)) {
        grid.values[i] = OccupancyGrid::kOccupied;
      }
    });
  }
  return grid;
}

OccupancyGrid occupancyGrid(const PlanarMap& map, double cell, const GridBand& band) {
  requireInRange("cell", cell, 0.0, 1e6, "m");
  ExportOptions options;
  options.cell = cell;
  options.band = band;
  return gridOf(exportedOf(map, Space::Free, options));
}

Contents writePgm(const ExportedMap& map, const std::string& path) {
  const OccupancyGrid grid = gridOf(map);
  std::string pgm = concatenated("P5\n# planar_mapping, ", grid.cell, " m/pix\n", grid.width, ' ',
                                 grid.height, "\n255\n");
  pgm.reserve(pgm.size() + grid.values.size());
  for (std::uint32_t y = grid.height; y-- > 0;) {  // the first row has the largest y
    for (std::uint32_t x = 0; x < grid.width; ++x) {
      const std::int8_t value = grid.at(x, y);
      pgm += static_cast<char>(value == OccupancyGrid::kOccupied ? 0
                               : value == OccupancyGrid::kFree   ? 254
                                                                 : 205);
    }
  }
  std::string yaml =
      concatenated("# planar_mapping, frame ", map.options.frame_id, ", from ",
                   grid.ground + map.options.band.low, " to ", grid.ground + map.options.band.high,
                   " m along its up axis where the ground is at ", grid.ground, "\n");
  if (!map.up.isApprox(Vector3::UnitZ())) {
    append(yaml, "# The axes are those of the map turned by the quaternion x, y, z, w: ",
           listOf(turning(map.up, Vector3::UnitZ()), ", "), '\n');
  }
  // 205 is read as unknown only with a threshold of 0.196, not with 0.25.
  append(yaml, originNote(map, "# ", ": the place of the map's own origin in the world\n"),
         "image: ", stemOf(path), ".pgm\nmode: trinary\nresolution: ", grid.cell, "\norigin: [",
         listOf(Vector3(grid.origin.x(), grid.origin.y(), 0.0), ", "),
         "]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n");
  return {std::move(pgm), std::move(yaml)};
}

}  // namespace planar_mapping::io
