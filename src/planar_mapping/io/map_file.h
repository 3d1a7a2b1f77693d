// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::io {

/// Writes a .pmap file (docs/file_format.md), whole or not at all. A finished map
/// (PlanarMap::finished()) takes fewer bytes.
/// \throws IoError if the file exists and must not be overwritten, or cannot be written
PLANAR_MAPPING_EXPORT void saveMap(const PlanarMap& map, const std::string& path,
                                   Overwrite overwrite = Overwrite::Refuse);

/// map.pmap where \p path is the result folder of a run, else the path itself.
PLANAR_MAPPING_EXPORT std::string mapFileOf(const std::string& path);

/// A tile of a map in a file of its own, see tileOf().
struct MapTile {
  int x = 0;
  int y = 0;
  std::string path;
};
/// The tiles in a folder, map_X_Y.pmap, by x and y; none if it is no folder.
PLANAR_MAPPING_EXPORT std::vector<MapTile> mapTilesOf(const std::string& folder);
/// These tiles as one map. \throws IoError as loadMap(); InputError if they do not fit together
PLANAR_MAPPING_EXPORT PlanarMap loadTiles(const std::vector<MapTile>& tiles, int threads = 0);

/// Reads a .pmap file, or that of a result folder, or the tiles of a folder as one map, of version
/// 5; those of earlier versions are refused. Whatever the file holds, no more than 1 MiB + 256
/// times its size is unpacked from it. \param threads  PlanarMap::deserialize(); 0 = all cores
/// \throws IoError if the file is missing, unreadable, cut short, damaged, of another version or no
///         map
PLANAR_MAPPING_EXPORT PlanarMap loadMap(const std::string& path, int threads = 0);

}  // namespace planar_mapping::io
