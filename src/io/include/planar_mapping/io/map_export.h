// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/core/geometry/cuboid.h"
#include "planar_mapping/core/base/export.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/map/planar_map.h"

// A map for other programs. World frame, metres, z up; numbers are written so that they read back
// as the same values, in any locale.
namespace planar_mapping {
namespace io {

/// One cuboid a line, after a line of names: `cx,cy,cz,sx,sy,sz,qx,qy,qz,qw,plane_id,probability,
/// state`; sizes are full lengths.
PLANAR_MAPPING_EXPORT std::string cuboidsToCsv(const std::vector<Cuboid>& cuboids);
/// An ASCII PLY mesh: eight vertices and twelve triangles a cuboid, wound outwards, coloured by
/// plane; gray = on no plane.
PLANAR_MAPPING_EXPORT std::string cuboidsToPly(const std::vector<Cuboid>& cuboids);
/// A Wavefront OBJ mesh: an object of six quadrilaterals for each cuboid, wound outwards.
PLANAR_MAPPING_EXPORT std::string cuboidsToObj(const std::vector<Cuboid>& cuboids);
/// An SDFormat 1.7 model for Gazebo: one static link, a box for each cuboid to collide with and to
/// see.
PLANAR_MAPPING_EXPORT std::string cuboidsToSdf(const std::vector<Cuboid>& cuboids);

/// Which cuboids are exported.
enum class ExportedSpace { Occupied, OccupiedAndUnknown };

/// Extensions that exportMap() knows, as "csv, json, ...".
PLANAR_MAPPING_EXPORT std::string exportExtensions();

/// Writes a map, whole or not at all, in the format that the extension of the path names: pmap and
/// json (the whole map, whatever \p space is), csv, ply, obj, sdf.
/// \throws ParameterError if the extension is none of these
/// \throws IoError if the file exists and must not be overwritten, or cannot be written
PLANAR_MAPPING_EXPORT void exportMap(const PlanarMap& map, const std::string& path,
                                     ExportedSpace space = ExportedSpace::Occupied,
                                     Overwrite overwrite = Overwrite::Refuse);

}  // namespace io
}  // namespace planar_mapping
