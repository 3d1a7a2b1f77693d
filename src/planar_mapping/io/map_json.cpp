// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/map_json.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/io/text_lines.h"
#include "planar_mapping/map/joined_map.h"

namespace planar_mapping::io {
namespace {

/// The text is handed on in parts of about so many bytes.
constexpr std::size_t kPart = std::size_t{1} << 16;

void appendPlane(std::string& out, const MapPlane& plane) {
  const Vector4 c = plane.plane.coefficients();
  append(out, "{\"id\": ", plane.id, ", \"coefficients\": [",
         NumberList{4, ", ", {c[0], c[1], c[2], c[3]}},
         "], \"tilt_rad\": ", normalizedTilt(plane.plane), ", \"rms_m\": ", plane.rms(),
         ", \"frames\": ", plane.frames, '}');
}

void appendCuboid(std::string& out, const Cuboid& cuboid) {
  append(out, "{\"center\": [", listOf(cuboid.center, ", "), "], \"size\": [",
         listOf(cuboid.size, ", "), "], \"quaternion_xyzw\": [", listOf(cuboid.orientation, ", "),
         "], \"plane_id\": ", cuboid.plane_id, ", \"probability\": ", cuboid.probability,
         ", \"state\": \"", toString(cuboid.state), "\"}");
}

/// One element a line.
template <typename Items, typename Append>
void appendLines(std::string& out, bool& first, const Items& items, Append&& append_item,
                 const ByteSink& sink) {
  for (const auto& item : items) {
    out += first ? "\n    " : ",\n    ";
    first = false;
    append_item(out, item);
    if (out.size() < kPart) continue;
    sink(out);
    out.clear();
  }
}

}  // namespace

void writeMapJson(const PlanarMap& map, const std::string& frame_id, const ByteSink& sink,
                  std::size_t most_unknown) {
  const bool is_listed = map.unknownCells() <= most_unknown;
  std::string out;
  append(out, "{\n  \"format\": \"planar_mapping map\",\n  \"version\": 1,\n  \"frame_id\": \"",
         frame_id, "\",\n  \"up\": [", listOf(map.params().approximation.up.normalized(), ", "),
         "],\n  \"unit\": \"m\",\n  \"resolution_m\": ", map.params().approximation.resolution);
  if (const Vector3& origin = map.params().origin; !origin.isZero(0.0))
    append(out, ",\n  \"origin_m\": [", listOf(origin, ", "), ']');
  append(out, ",\n  \"unseen\": \"", map.params().unseen == Unseen::Unknown ? "unknown" : "free",
         "\",\n  \"unknown_space\": \"", is_listed ? "listed" : "not listed",
         "\",\n  \"frames\": ", map.frames(), ",\n  \"planes\": [");
  bool first = true;
  appendLines(out, first, map.planes(), appendPlane, sink);
  out += first ? "],\n  \"cuboids\": [" : "\n  ],\n  \"cuboids\": [";
  first = true;
  appendLines(out, first, map.cuboids(), appendCuboid, sink);
  if (is_listed) appendLines(out, first, map.unknownCuboids(), appendCuboid, sink);
  out += first ? "]\n}\n" : "\n  ]\n}\n";
  sink(out);
}

void saveMapJson(const PlanarMap& map, const std::string& path, Overwrite overwrite,
                 const std::string& frame_id) {
  AtomicFile file(path, overwrite);
  writeMapJson(map, frame_id, [&file](std::string_view part) { file.write(part); });
  file.commit();
}

void saveMap(const PlanarMap& map, const std::string& path, Overwrite overwrite) {
  const std::vector<std::uint8_t> bytes = map.serialize();
  AtomicFile file(path, overwrite);
  file.write(bytes.data(), bytes.size());
  // What cannot be read back must not replace what can.
  if (file.readBack() != bytes)
    throw IoError(path, "what was read back is not what was written; is the disk faulty?");
  PlanarMap::deserialize(bytes.data(), bytes.size());
  file.commit();
}

std::string mapFileOf(const std::string& path) {
  const std::filesystem::path file = std::filesystem::path(path) / "map.pmap";
  std::error_code ignored;
  return std::filesystem::is_regular_file(file, ignored) ? file.string() : path;
}

std::vector<MapTile> mapTilesOf(const std::string& folder) {
  std::vector<MapTile> tiles;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    MapTile tile;
    int end = 0;
    const std::string name = entry.path().filename().string();
    if (std::sscanf(name.c_str(), "map_%d_%d.pmap%n", &tile.x, &tile.y, &end) != 2 ||
        static_cast<std::size_t>(end) != name.size())
      continue;
    tile.path = entry.path().string();
    tiles.push_back(std::move(tile));
  }
  std::sort(tiles.begin(), tiles.end(), [](const MapTile& a, const MapTile& b) {
    return std::make_pair(a.x, a.y) < std::make_pair(b.x, b.y);
  });
  return tiles;
}

PlanarMap loadTiles(const std::vector<MapTile>& tiles, int threads) {
  JoinedMap joined;
  for (const MapTile& tile : tiles)
    joined.set(static_cast<std::int32_t>(joined.size()),
               std::make_shared<const PlanarMap>(loadMap(tile.path, threads)), Pose::Identity());
  return joined.map();
}

PlanarMap loadMap(const std::string& folder_or_file, int threads) {
  const std::string path = mapFileOf(folder_or_file);
  const std::vector<MapTile> tiles = mapTilesOf(path);
  if (!tiles.empty()) return loadTiles(tiles, threads);
  const std::vector<std::uint8_t> bytes = readWholeFile(path);
  try {
    return PlanarMap::deserialize(bytes.data(), bytes.size(), threads);
  } catch (const IoError&) {
    throw;
  } catch (const Error& error) {
    throw IoError(path, error.what());
  }
}

}  // namespace planar_mapping::io
