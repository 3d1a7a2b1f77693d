// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <string>

#include "planar_mapping/base/export.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::io {

/// The cuboids of a map as readable JSON, a cuboid a line; in the axes of the map:
/// `{"format", "version", "frame_id", "up", "unit", "resolution_m", "frames", "planes": [...],
/// "cuboids": [...]}`. `up` is the unit vector that points up, `unit` is "m"; a map with an origin
/// of its own has `origin_m`, to be added for coordinates of the world.
/// A plane has `id`, `coefficients` [a, b, c, d], `tilt_rad` and `rms_m`; a cuboid has `center`,
/// `size` (full lengths), `quaternion_xyzw`, `plane_id` (-1 = none), `probability` and `state`.
/// Occupied cuboids come first, in the order of PlanarMap::cuboids(), then unknown space as
/// PlanarMap::unknownCuboids() lists it; `unseen` says what space is beyond. `unknown_space` is
/// "listed", or "not listed" where it has more than \p most_unknown cells.
/// Numbers read back as the same values, in any locale.
/// \param frame_id name of the map's frame, of letters, digits and _-./
/// \param sink     gets the text in parts: that of a large map need not be in memory
PLANAR_MAPPING_EXPORT void writeMapJson(
    const PlanarMap& map, const std::string& frame_id, const ByteSink& sink,
    std::size_t most_unknown = std::numeric_limits<std::size_t>::max());

/// Writes writeMapJson() to a file, whole or not at all.
/// \throws IoError if the file exists and must not be overwritten, or cannot be written
PLANAR_MAPPING_EXPORT void saveMapJson(const PlanarMap& map, const std::string& path,
                                       Overwrite overwrite = Overwrite::Refuse,
                                       const std::string& frame_id = "map");

}  // namespace planar_mapping::io
