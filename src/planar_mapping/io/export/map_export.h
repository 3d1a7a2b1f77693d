// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/plan/plan.h"

// A map for other programs (docs/exports.md says who reads what, what is kept and what is lost).
// Metres, in the axes of the map unless a format fixes its own; numbers in text are the shortest
// that read back as the same values, in any locale.
namespace planar_mapping::io {

/// What the points of a PCD file are.
enum class ExportedPoints {
  Centers,  ///< the centre of each cuboid
  Surface,  ///< a grid on its faces
};

/// What a page tells of the run that made the map: the text of its files, empty = none.
struct RunRecord {
  std::string title;    ///< of the page; empty = the name of its file
  std::string metrics;  ///< metrics.json
  std::string frames;   ///< frames.csv
  std::string log;      ///< run.log
};

/// What exportMap() writes; lengths in metres. Each format uses those that concern it.
struct ExportOptions {
  bool unknown =
      false;  ///< unknown space as well, as boxes; json, pmap, bt, ot, pgm, html always tell
  std::string frame_id = "map";  ///< name of the map's frame (json, csv, urdf, pgm)
  double cell = 0.0;      ///< side of a cell of bt, ot and of plans; 0 = the map's resolution
  RobotModel robot;       ///< of plans: pgm, svg, dxf, html
  bool distance = false;  ///< pgm: the distance to the nearest obstacle as well, as .npy
  ExportedPoints points = ExportedPoints::Centers;  ///< pcd
  double spacing = 0.0;  ///< pcd: between points of a surface; 0 = half the map's resolution
  RunRecord run;         ///< html
  Overwrite overwrite = Overwrite::Refuse;
};

/// A format that exportMap() writes.
struct ExportFormat {
  std::string extension;  ///< with its dot; "/" for a Gazebo model folder
  std::string readers;    ///< a line: what is written and which programs read it
};
/// All of them, in the order of the table in docs/exports.md.
PLANAR_MAPPING_EXPORT std::vector<ExportFormat> exportFormats();

/// The files that exportMap() writes for this path, the one that is asked for first.
/// \param storeys  of plans: where there are several they follow as NAME_0, NAME_1 ..., the lowest
/// first;
///        NAME is the one on which the path ends
/// \throws ParameterError if there is no such format
PLANAR_MAPPING_EXPORT std::vector<std::string> exportedFiles(const std::string& path,
                                                             bool distance = false,
                                                             std::size_t storeys = 1);

/// Writes a map in the format that the extension of the path names; a path that ends in a slash
/// is a Gazebo model folder. Formats of several files (pgm with its yaml, obj with its mtl, the
/// folder) write them beside each other. Each file appears whole or not at all; on an error before
/// the last step none does. Thread-safe for different paths.
/// \throws ParameterError if there is no such format, an option is out of range, or the cells are
///         so small that the result would not fit the memory meant for it (the message names a cell
///         that does)
/// \return what a user should know, for each storey of a plan: how much of it is free
/// \throws IoError if a file exists and must not be overwritten, or cannot be written
PLANAR_MAPPING_EXPORT std::vector<std::string> exportMap(
    const PlanarMap& map, const std::string& path, const ExportOptions& options = ExportOptions());

}  // namespace planar_mapping::io
