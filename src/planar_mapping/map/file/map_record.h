// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "planar_mapping/map/file/label_tree.h"
#include "planar_mapping/map/store/map_data.h"

namespace planar_mapping::detail {

/// What a file holds of a plane, beside its cells.
struct PlaneRecord {
  std::int32_t id = 0;
  std::uint32_t frames = 0;
  PlaneFrame frame;
  PlaneMoments moments;
  std::array<std::int32_t, 2> anchor{};  ///< of the patches, in tiles
  std::uint32_t regions = 0;             ///< of MapRecord::tiles
};

/// What a file holds (docs/file_format.md).
struct MapRecord {
  bool is_finished = false;  ///< then there are only parameters, cuboids and unknown space
  PlanarMapParams params;
  std::vector<Cuboid> cuboids;  ///< of a map that is not finished: written, not read
  std::int32_t next_plane_id = 0;
  std::vector<PlaneRecord> planes;  ///< by id
  LabelTree tiles{2};               ///< of one plane after the other
  Int3 anchor;                      ///< of the regions of non-planar cells, in blocks
  LabelTree blocks{3};
  std::vector<std::uint8_t> beliefs;         ///< of the occupied cells of tiles, then blocks
  std::vector<std::uint8_t> octants;         ///< of the cells of blocks, in the compact profile
  std::vector<CellBlock::Mean> means;        ///< of the cells of blocks, in the paper's
  std::vector<std::uint32_t> region_frames;  ///< by CellLayer::regionKey(), ascending
  LabelTree space{3};
  std::vector<FramePose> trajectory;
  std::vector<GroundPlace> ground;
};

/// \param cuboids of the map
MapRecord recordOf(const MapData& map, std::vector<Cuboid> cuboids);
/// Without what only further frames need; probabilities of cuboids are 1.
MapRecord finishedRecordOf(const MapData& map, std::vector<Cuboid> cuboids);
/// \throws Error if the parts do not fit each other
MapData mapOf(const MapRecord& record);

/// The named sections of a map file, one after the other (docs/file_format.md, "Sections").
/// \throws Error if a value is beyond what a file may hold, which no map reaches
std::vector<std::uint8_t> sectionsOf(MapRecord record);
/// \throws Error naming the section and what is wrong
MapRecord recordOfSections(const std::vector<std::uint8_t>& sections, bool is_finished);

/// The bytes of a file (docs/file_format.md).
std::vector<std::uint8_t> serializeMap(MapRecord record);
/// \throws Error naming what is wrong
MapRecord deserializeMap(const std::uint8_t* data, std::size_t size);

}  // namespace planar_mapping::detail
