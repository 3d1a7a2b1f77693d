// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/export/occupancy_grid.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>
#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/oriented_box.h"
#include "planar_mapping/io/export/exported_map.h"
#include "planar_mapping/io/export/floors.h"

namespace planar_mapping::io {
namespace {

constexpr double kMaxCells = 5e7;

Cuboid turned(const Quaternion& turn, Cuboid cuboid) {
  cuboid.center = turn * cuboid.center;
  cuboid.orientation = turn * cuboid.orientation;
  return cuboid;
}

/// The grid while it is made; low and high are the heights of the band over the ground.
struct Columns {
  OccupancyGrid grid;
  GroundHeights ground;
  double low, high;
  /// Of a cell; the highest and, beyond a step, the lowest of it and those around it.
  std::vector<float> ground_at, level_at, foot_at;
  /// At its level: 2 = the middle is on a rectangle, 1 = up to half a cell beside one, 0 = none.
  std::vector<std::uint8_t> has_floor;

  Columns(GroundHeights heights, const GridBand& band)
      : ground(std::move(heights)), low(band.low), high(band.high) {}

  Raster raster() const {
    return {grid.origin, grid.cell, {static_cast<int>(grid.width), static_cast<int>(grid.height)}};
  }
  /// Cells at most so many rows and columns away.
  template <typename Visit>
  void forAround(std::size_t cell, int reach, const Visit& visit) const {
    const Raster cells = raster();
    const Eigen::Array2i place = cells.placeOf(cell);
    cells.forCells(place - reach, place + reach,
                   [&](const Eigen::Array2i& at) { visit(cells.numberOf(at)); });
  }

  /// \param follow  heights are those of the floor at each cell, where there is one; elsewhere of
  ///                the ground
  void followGround(const Floors& floors, bool follow) {
    const double step = DepthBelow(grid.cell).from;
    has_floor.assign(std::size_t{grid.width} * grid.height, 0);
    for (std::size_t i = 0; i < has_floor.size(); ++i) {
      const Vector2 at = raster().middleOf(raster().placeOf(i));
      const double found = ground.at({at.x(), at.y(), 0.0});
      const std::optional<Floors::Place> floor = floors.at(at, found);
      ground_at.push_back(static_cast<float>(floor && follow ? floor->height : found));
      if (floor && ground_at[i] - floor->height <= step) has_floor[i] = floor->is_inside ? 2 : 1;
    }
    level_at = foot_at = ground_at;
    for (std::size_t i = 0; i < has_floor.size(); ++i) {
      float lowest = ground_at[i];
      forAround(i, 1, [&](std::size_t other) {
        level_at[i] = std::max(level_at[i], ground_at[other]);
        lowest = std::min(lowest, ground_at[other]);
      });
      if (ground_at[i] - lowest > step) foot_at[i] = lowest;
      if (level_at[i] - ground_at[i] > step) has_floor[i] = 0;
    }
  }

  /// Cells that have no floor at their level and free space under it; beside them cells without a
  /// floor, in the shadow of an edge, and what a rectangle covers, which may reach over an edge by
  /// a cell and a half; and a cell around all.
  ///
  /// \param hollow  free space under the level of each cell, metres
  std::vector<std::uint8_t> drops(const std::vector<float>& hollow) const {
    constexpr double kShadow = 1.0;  // metres
    constexpr int kOverhang = 2;     // cells
    constexpr int kSure = 5;         // of a cell and those around it: fewer may be noise
    const double enough = DepthBelow(grid.cell).enough;
    std::vector<std::uint8_t> is_open(hollow.size(), 0), around(hollow.size(), 0);
    std::vector<std::size_t> edge;
    for (std::size_t i = 0; i < hollow.size(); ++i)
      is_open[i] = hollow[i] >= enough && has_floor[i] < 2 ? 1 : 0;
    std::vector<std::uint8_t> is_drop = is_open;
    for (std::size_t i = 0; i < hollow.size(); ++i) {
      if (is_open[i] == 0) continue;
      int count = 0;
      forAround(i, 1, [&](std::size_t k) { count += is_open[k]; });
      if (count >= kSure) edge.push_back(i);
      forAround(i, kOverhang, [&](std::size_t k) { is_drop[k] |= hollow[k] >= enough ? 1 : 0; });
    }
    for (double reach = 0.0; reach < kShadow && !edge.empty(); reach += grid.cell) {
      for (const std::size_t i : std::exchange(edge, {})) {
        forAround(i, 1, [&](std::size_t k) {
          if (is_open[k] != 0 || has_floor[k] != 0) return;
          is_open[k] = is_drop[k] = 1;
          edge.push_back(k);
        });
      }
    }
    for (std::size_t i = 0; i < hollow.size(); ++i)
      if (is_drop[i] != 0) forAround(i, 1, [&](std::size_t k) { around[k] = 1; });
    return around;
  }

  template <typename Visit>
  void forEachCellBelow(const Cuboid& cuboid, const Vector3& reach, const Visit& visit) const {
    raster().forCellsAround(cuboid.center.head<2>(), reach.head<2>(), visit);
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

/// A word that YAML would read as something else is quoted.
std::string yamlOf(const std::string& name) {
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-' || c == '/' || c > 127;
  };
  if (name[0] != '-' && std::all_of(name.begin(), name.end(), is_plain)) return name;
  std::string quoted = "'";
  for (const char c : name) quoted.append(c == '\'' ? 2 : 1, c);
  return quoted + "'";
}

}  // namespace

OccupancyGrid occupancyGrid(const GridSource& source, double cell, const GridBand& band,
                            std::vector<std::uint8_t>* obstacles) {
  requireInRange("cell", cell, 0.0, 1e12, "m");
  requireInRange("band low", band.low, -1e6, 1e6, "m");
  requireInRange("band high", band.high, -1e6, 1e6, "m");
  requireInRange("free fraction", band.free_fraction, 0.0, 1.0);
  if (!(band.low < band.high))
    throw ParameterError("a band must end above its beginning, not go from " +
                         std::to_string(band.low) + " to " + std::to_string(band.high) + " m");
  const Quaternion turn = turning(source.up, Vector3::UnitZ());
  std::vector<Cuboid> cuboids, space;
  for (const Cuboid& cuboid : source.cuboids) cuboids.push_back(turned(turn, cuboid));
  for (const Cuboid& cuboid : source.space) space.push_back(turned(turn, cuboid));
  const bool by_free = source.unseen == Unseen::Unknown;

  std::vector<GroundPoint> ground;
  double height = band.ground;
  const bool is_found = std::isnan(height);
  if (is_found) {
    height = groundHeight(source.cuboids, source.up, source.sensors);
    for (const GroundPoint& point : source.ground)
      ground.push_back({turn * point.position, point.points});
  }
  const double low = band.low > 0.0 ? std::min(band.low, GridBand().low) : GridBand().low;
  const Floors floors(cuboids, by_free ? space : std::vector<Cuboid>(),
                      GroundHeights(ground, Vector3::UnitZ(), height), low, cell);
  if (is_found && ground.empty()) ground = floors.ground();
  Columns columns(GroundHeights(ground, Vector3::UnitZ(), height), band);
  OccupancyGrid& grid = columns.grid;
  grid.cell = cell;
  grid.ground = columns.ground.middle();
  requireInRange("ground", grid.ground, -1e6, 1e6, "m");
  placeGrid(cuboids, space, columns);
  columns.followGround(floors, is_found && band.low > 0.0);
  const std::size_t count = std::size_t{grid.width} * grid.height;

  // Heights in the band, and of those under the level of the place, that were seen free.
  const DepthBelow below(cell);
  std::vector<float> seen(count, 0.0f), hollow(count, 0.0f);
  for (const Cuboid& cuboid : space) {
    const Matrix3 to_local = cuboid.orientation.conjugate().toRotationMatrix();
    columns.forEachCellBelow(
        cuboid, detail::OrientedBox(cuboid).reach(), [&](std::size_t i, const Vector2& at) {
          const auto inside = [&](double from, double to) {
            return static_cast<float>(lengthInside(to_local, cuboid, at, from, to));
          };
          seen[i] += inside(columns.ground_at[i] + band.low, columns.ground_at[i] + band.high);
          hollow[i] += inside(columns.level_at[i] - below.to, columns.level_at[i] - below.from);
        });
  }
  const double high = band.high - band.low;
  const double enough = (by_free ? band.free_fraction : 1.0 - band.free_fraction) * high;
  grid.values.assign(count, OccupancyGrid::kUnknown);
  const std::vector<std::uint8_t> drops =
      by_free ? columns.drops(hollow) : std::vector<std::uint8_t>(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    if ((seen[i] >= enough * (1.0 - 1e-5)) == by_free && drops[i] == 0)
      grid.values[i] = OccupancyGrid::kFree;
  }
  if (obstacles != nullptr) obstacles->assign(cuboids.size(), 0);
  for (std::size_t c = 0; c < cuboids.size(); ++c) {
    const Cuboid& cuboid = cuboids[c];
    if (cuboid.state != CellState::Occupied) continue;
    const bool is_low =
        isLevel(cuboid, Vector3::UnitZ()) &&
        cuboid.center.z() + 0.5 * cuboid.size.z() <= columns.ground.at(cuboid.center) + band.low;
    if (band.low > 0.0 && (is_low || floors.contains(c))) continue;
    const detail::OrientedBox box(cuboid);
    columns.forEachCellBelow(cuboid, box.reach(), [&](std::size_t i, const Vector2& at) {
      const double from = columns.foot_at[i] + band.low, to = columns.ground_at[i] + band.high;
      const Vector3 half = (1.0 - 1e-6) * 0.5 * Vector3(grid.cell, grid.cell, to - from);
      if (!box.meets({at.x(), at.y(), 0.5 * (from + to)}, half)) return;
      grid.values[i] = OccupancyGrid::kOccupied;
      if (obstacles != nullptr) (*obstacles)[c] = 1;
    });
  }
  return grid;
}

OccupancyGrid gridOf(const ExportedMap& map) {
  return occupancyGrid({map.cuboids, map.free, Unseen::Unknown, map.up, map.ground, map.sensors},
                       map.cell(), map.options.band);
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
  if (!map.up.isApprox(Vector3::UnitZ()))
    append(yaml, "# The axes are those of the map turned by the quaternion x, y, z, w: ",
           listOf(turning(map.up, Vector3::UnitZ()), ", "), '\n');
  // Without the rounding of cell times count: -3.3, not -3.3000000000000003.
  const Vector2 origin = (1e9 * grid.origin).array().round() / 1e9;
  // 205 is read as unknown only with a threshold of 0.196, not with 0.25.
  append(yaml, originNote(map, "# ", ": the place of the map's own origin in the world\n"),
         "image: ", yamlOf(stemOf(path) + ".pgm"), "\nmode: trinary\nresolution: ", grid.cell,
         "\norigin: [", origin.x(), ", ", origin.y(),
         ", 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n");
  return {std::move(pgm), std::move(yaml)};
}

}  // namespace planar_mapping::io
