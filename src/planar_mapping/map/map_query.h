// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/map/planar_map.h"

// Questions of planners to a map, beside PlanarMap::stateAt(). World frame, metres. Their cost
// grows with the logarithm of the number of cuboids and with the number of those that are near the
// ray or the box; where unknown space counts, also with the number of its cells that they meet.
namespace planar_mapping {

/// Where a ray first meets what is not free.
struct RayHit {
  double distance = 0.0;                  ///< from the origin of the ray; 0 = it starts there
  Vector3 point = Vector3::Zero();        ///< there
  CellState state = CellState::Occupied;  ///< Occupied or Unknown
  std::int32_t cuboid = -1;               ///< index into PlanarMap::cuboids(), -1 = unknown space
};

/// What a ray passes on its way.
enum class UnknownSpaceIs : std::uint8_t { AnObstacle, Transparent };

/// The first cuboid, or cell of unknown space, that the ray from \p origin along \p direction (any
/// length but 0) enters within \p range. Unknown space through which the ray comes from free space
/// to a cuboid within the diagonal of a cell is not one: the cuboid cuts its cell.
/// \throws ParameterError if a number is not finite, direction is 0, range is not positive, or the
///         ray would pass more than 10 million cells
PLANAR_MAPPING_EXPORT std::optional<RayHit> castRay(
    const PlanarMap& map, const Vector3& origin, const Vector3& direction, double range,
    UnknownSpaceIs unknown = UnknownSpaceIs::AnObstacle);

/// State of what such a ray first meets, Free if all that it passes within \p range was seen free.
PLANAR_MAPPING_EXPORT CellState stateAlong(const PlanarMap& map, const Vector3& origin,
                                           const Vector3& direction, double range);

/// State of an axis-aligned box.
struct BoxState {
  CellState state =
      CellState::Free;  ///< Occupied if a cuboid meets it, else Unknown if any part is
  Indices cuboids;      ///< that meet it: indices into PlanarMap::cuboids(), ascending
};

/// \param low, high  opposite corners, low <= high
/// \throws ParameterError if a number is not finite, low exceeds high, or the box holds more than
///         10 million cells
PLANAR_MAPPING_EXPORT BoxState stateOfBox(const PlanarMap& map, const Vector3& low,
                                          const Vector3& high);

/// How much of space two maps classify differently. Cells of half the smaller resolution, by their
/// centres.
struct PLANAR_MAPPING_EXPORT MapDifference {
  double cell = 0.0;  ///< side of these cells
  std::size_t only_in_a = 0;
  std::size_t only_in_b = 0;
  std::size_t in_both = 0;

  /// Fraction of the cells occupied in either that are not in both, in [0, 1]; 0 for two empty
  /// maps.
  double fraction() const;
};

PLANAR_MAPPING_EXPORT MapDifference compareMaps(const PlanarMap& a, const PlanarMap& b);

}  // namespace planar_mapping
