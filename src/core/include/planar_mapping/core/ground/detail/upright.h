// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/base/types.h"
#include "planar_mapping/core/planes/multi_plane.h"

namespace planar_mapping {

/// Parameters of findUpright(); all [ours]. Angles in radians, shares of the points on planes.
struct PLANAR_MAPPING_EXPORT UprightParams {
  /// Upwards if the sensor stands level, in its frame; need not have unit length, not zero.
  Vector3 expected_up = -Vector3::UnitY();
  double max_tilt = 50.0 * M_PI / 180.0;  ///< of the sensor, in (0, pi/2)
  /// Standard deviation of the tilt: of directions that explain the planes alike, the one nearer
  /// to level is taken; > 0.
  double usual_tilt = 30.0 * M_PI / 180.0;
  double level_tolerance = M_PI / 180.0;  ///< a smaller tilt is none, in [0, max_tilt)
  double tolerance = 4.0 * M_PI / 180.0;  ///< of what is horizontal or vertical, in (0, pi/4)
  double min_support = 0.7;               ///< that must be horizontal or vertical, in (0, 1]
  double min_vertical = 0.1;              ///< that must be vertical; below it, ...
  double min_ground = 0.5;  ///< ... that must be on one horizontal plane below the sensor
  /// Where another direction is as likely as this share of the best one, neither is taken; in
  /// (0, 1].
  double max_ambiguity = 0.7;

  /// \throws ParameterError
  void validate() const;
};

/// The direction upwards, by the planes of a cloud.
struct Upright {
  bool found = false;             ///< false: take the sensor for level
  Vector3 up = Vector3::UnitZ();  ///< unit length, sensor's frame; expected_up unless found
  double tilt = 0.0;              ///< between up and expected_up
  double horizontal = 0.0;        ///< share of the points on horizontal planes
  double vertical = 0.0;          ///< ... on vertical ones
};

/// Finds the direction upwards in a cloud from what people build: floors, ceilings and tables are
/// horizontal, walls and sides of furniture vertical.
///
/// Candidates are the normals of planes and the lines in which two planes meet, within max_tilt of
/// level. The one that makes most of the points lie on horizontal or vertical planes is taken, if
/// there are vertical ones to confirm it or most of the points are on one plane below the sensor,
/// if level does not explain as much, and if no other direction does; then it is fitted to all of
/// those planes. O(planes^3), at most the 20 largest count.
/// \param planes  with the sensor at the origin
/// \throws ParameterError
PLANAR_MAPPING_EXPORT Upright findUpright(const std::vector<PlaneSegment>& planes,
                                          const UprightParams& params);
/// The same of the planes of a cloud, with the sensor at the origin.
/// \param expected_up  as in UprightParams
PLANAR_MAPPING_EXPORT Upright findUpright(const PointsView& points,
                                          const std::optional<StereoNoise>& noise,
                                          const Vector3& expected_up);

}  // namespace planar_mapping
