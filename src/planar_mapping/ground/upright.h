// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping {

/// The direction upwards, by the planes of a cloud.
struct Upright {
  bool found = false;             ///< false: take the sensor for level
  Vector3 up = Vector3::UnitZ();  ///< unit length, sensor's frame; expected_up unless found
  double tilt = 0.0;              ///< between up and expected_up
  double horizontal = 0.0;        ///< fraction of the points on horizontal planes
  double vertical = 0.0;          ///< ... on vertical ones
  /// Nothing is horizontal by it, or was by what was found instead, and half of the points are on
  /// planes of one direction: they may be walls or floors.
  bool is_uncertain = false;
};

/// Finds the direction upwards in a cloud from what people build: floors, ceilings and tables are
/// horizontal, walls and sides of furniture vertical.
///
/// Candidates are the normals of planes and the lines in which two planes meet, within 65 degrees
/// of level; beyond 25 degrees something horizontal has to be below the sensor. The one that makes
/// most of the points lie on horizontal or vertical planes is taken, if there are vertical ones to
/// confirm it or most of the points are on one plane below the sensor, if level does not explain as
/// much, and if no other direction does; then it is fitted to all of those planes. O(planes^3), at
/// most the 20 largest count.
/// \param planes       with the sensor at the origin
/// \param expected_up  upwards if the sensor stands level, in its frame; of any length
/// \param axis  unit vector: upwards, uncertainly, where nothing is horizontal by what was found,
///              but half of the points are below the sensor on planes that are by this
/// \throws ParameterError if expected_up is zero or not finite
PLANAR_MAPPING_EXPORT Upright findUpright(const std::vector<PlaneSegment>& planes,
                                          const Vector3& expected_up,
                                          const std::optional<Vector3>& axis = std::nullopt);
/// The same of the planes of a cloud, with the sensor at the origin.
PLANAR_MAPPING_EXPORT Upright findUpright(const PointsView& points,
                                          const std::optional<StereoNoise>& noise,
                                          const Vector3& expected_up,
                                          const std::optional<Vector3>& axis = std::nullopt);

}  // namespace planar_mapping
