// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/core/geometry/cuboid.h"
#include "planar_mapping/io/map_export.h"

namespace planar_mapping::io {

/// What a format is written from.
struct ExportedMap {
  std::vector<Cuboid> cuboids;  ///< occupied, then unknown if asked for
  std::vector<Cuboid> free;     ///< seen free; only for formats that say so
  Vector3 up = Vector3::UnitZ();
  Vector3 origin = Vector3::Zero();  ///< PlanarMapParams::origin
  std::vector<Vector3> sensors;      ///< places of the trajectory, where they are known
  std::vector<GroundPoint> ground;   ///< PlanarMap::ground()
  double resolution = 0.1;
  ExportOptions options;

  double cell() const { return options.cell > 0.0 ? options.cell : resolution; }
};

/// What a format needs to know of space.
enum class Space {
  AsAsked,  ///< unknown cuboids if the options say so
  Free,     ///< what was seen free
};
ExportedMap exportedOf(const PlanarMap& map, Space space, const ExportOptions& options);
OccupancyGrid gridOf(const ExportedMap& map);

// Each returns what the files hold, in the order of exportedFiles(); path is the one asked for.
using Contents = std::vector<std::string>;
Contents writeCsv(const ExportedMap& map, const std::string& path);
Contents writeGlb(const ExportedMap& map, const std::string& path);
Contents writeObj(const ExportedMap& map, const std::string& path);
Contents writeOctree(const ExportedMap& map, const std::string& path);  ///< .bt, .ot
Contents writePoints(const ExportedMap& map, const std::string& path);
Contents writePgm(const ExportedMap& map, const std::string& path);
Contents writePly(const ExportedMap& map, const std::string& path);
Contents writeScene(const ExportedMap& map, const std::string& path);
Contents writeSdf(const ExportedMap& map, const std::string& path);
Contents writeModelFolder(const ExportedMap& map, const std::string& path);
Contents writeStl(const ExportedMap& map, const std::string& path);
Contents writeUrdf(const ExportedMap& map, const std::string& path);
Contents writeVtp(const ExportedMap& map, const std::string& path);

/// "origin_m X Y Z" between two texts for a map that has an origin of its own, else nothing.
std::string originNote(const ExportedMap& map, const char* before, const char* after);

/// The name of a file without folder and extension, or of a folder.
std::string stemOf(const std::string& path);

}  // namespace planar_mapping::io
