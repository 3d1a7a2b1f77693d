// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::detail {

/// Planes that would be the floor if the map were level.
struct LeaningFloor {
  enum class Kind : std::uint8_t {
    /// The largest plane that the sensors stood above leans by 5 to 45 degrees: more likely than
    /// such a floor is a start that was not level.
    Leans,
    /// It is level for the sensor, in poses that turn the cloud and do not move it.
    LevelWithoutTurn,
    /// Nearly all planes of a merged cloud face along another axis of the world, and none is level.
    OtherAxis,
  };
  double area = 0.0;  ///< of its cuboids, m2
  double tilt = 0.0;  ///< radians
  Kind kind = Kind::Leans;
  Vector3 up = Vector3::UnitZ();  ///< by which it is level; the sign of OtherAxis is not known
};

/// Of the first two kinds the plane has a fifth of the area of all planes, and no level plane has
/// half of its own.
/// \param is_camera  of a camera's view only the first kind is looked for: it may see one wall, and
///        its z is not upwards
PLANAR_MAPPING_EXPORT std::optional<LeaningFloor> leaningFloor(const PlanarMap& map,
                                                               bool is_camera);

}  // namespace planar_mapping::detail
