// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "cuboids/cuboid_index.h"
#include "store/map_data.h"

namespace planar_mapping::detail {

/// What a finished map has in place of planes and cells.
struct FinishedMap {
  std::vector<std::uint8_t> file;  ///< that it was read from
  std::vector<Cuboid> cuboids;
  CuboidIndex index;

  /// On the heap, its own block included.
  std::size_t memoryBytes() const;
};

/// The bytes of docs/finished_map.md. \param cuboids of the map
std::vector<std::uint8_t> writeFinishedMap(const MapData& map, const std::vector<Cuboid>& cuboids);
/// Do the bytes start as those of a finished map?
bool isFinishedFile(const std::uint8_t* data, std::size_t size);
/// \param map gets parameters and space
/// \throws Error naming what is wrong
std::unique_ptr<const FinishedMap> readFinishedMap(const std::uint8_t* data, std::size_t size,
                                                   MapData& map);

}  // namespace planar_mapping::detail
