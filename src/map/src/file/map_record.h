// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "file/lattice_coder.h"
#include "store/map_data.h"

namespace planar_mapping::detail {

/// What a file holds of a plane.
struct PlaneRecord {
  std::int32_t id = 0;
  std::uint32_t frames = 0;
  StoredPlane stored;
  std::array<std::int32_t, 2> anchor{};  ///< of the patches, in tiles
  std::vector<LatticeBundle> tiles;
  std::vector<std::uint8_t> beliefs;  ///< of the cells, by tile and bit
};

/// What a file holds, as plain values in the order of the file (docs/file_format.md).
struct MapRecord {
  PlanarMapParams params;
  std::vector<StoredPose> trajectory;
  std::int32_t next_plane_id = 0;
  std::vector<PlaneRecord> planes;
  Int3 anchor;  ///< of the regions of non-planar cells, in blocks
  std::vector<LatticeBundle> blocks;
  std::vector<std::uint8_t> beliefs;
  std::vector<std::uint8_t> octants;         ///< of the cells, in the compact profile
  std::vector<CellBlock::Mean> means;        ///< of the cells, in the paper's
  std::vector<std::uint32_t> region_frames;  ///< by region key, ascending
  std::vector<LatticeBundle> space;          ///< ones: seen free, twos: unknown
};

/// Space as a file holds it: ones are seen free, twos unknown.
std::vector<LatticeBundle> bundlesOf(const UnknownSpace& space);

MapRecord recordOf(const MapData& map);
/// \throws Error if the parts do not fit each other
MapData mapOf(const MapRecord& record);

}  // namespace planar_mapping::detail
