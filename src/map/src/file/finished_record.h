// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "cuboids/half_cell_box.h"
#include "file/lattice_coder.h"
#include "store/map_data.h"
#include "planar_mapping/core/cuboids/raster/detail/plane_raster.h"

namespace planar_mapping::detail {

/// A plane whose rectangles are cuboids.
struct FinishedPlane {
  std::int32_t id = 0;
  StoredPlane stored;                     ///< its frame only
  std::uint8_t spread = 0;                ///< surfaceSpread()
  std::vector<CellRectangle> rectangles;  ///< in half cells, by (b, a, height, width)
};

/// A box on the lattice of half cells.
struct FinishedBox {
  HalfCellBox box;
  std::int32_t plane_id = -1;  ///< -1: its axes are x, y, z
};

/// A cuboid that lies on no lattice, in whole numbers.
struct FreeCuboid {
  static constexpr double kLength = 1.0 / 1024.0;  ///< cells
  static constexpr std::int32_t kOne = 1 << 15;    ///< of the quaternion

  std::array<std::int64_t, 3> center{};
  std::array<std::int64_t, 3> size{};
  std::array<std::int64_t, 4> turn{};  ///< quaternion x, y, z, w
  std::int32_t plane_id = -1;
};

/// What a finished map's file holds, as plain values in the order of the file
/// (docs/finished_map.md).
struct FinishedRecord {
  PlanarMapParams params;             ///< the usual ones, where questions do not need them
  std::vector<FinishedPlane> planes;  ///< by id
  std::vector<FinishedBox> boxes;     ///< by their lower corners (z, y, x), then sizes
  std::vector<FreeCuboid> free_cuboids;
  std::vector<LatticeBundle> space;  ///< ones: seen free, twos: unknown
};

/// \param cuboids of the map
FinishedRecord finishedRecordOf(const MapData& map, const std::vector<Cuboid>& cuboids);
/// Those of the record, all of probability 1.
std::vector<Cuboid> cuboidsOf(const FinishedRecord& record);

}  // namespace planar_mapping::detail
