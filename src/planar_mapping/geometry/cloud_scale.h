// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/camera.h"

namespace planar_mapping {

/// Size and density of a cloud, from which `auto` parameters follow (docs/parameters.md).
struct CloudScale {
  double extent = 0.0;  ///< diagonal of the box of the middle 98 % along each axis, metres
  /// Side of the square of surface that a point stands for, metres: half of the points stand for
  /// less.
  double spacing = 0.0;
  double noise = 0.0;      ///< RMS distance of neighbouring points from their plane, metres
  double max_range = 0.0;  ///< 99 % of the points are nearer to the sensor, metres
  /// Depth up to which points are mapped, metres, where a stage limits it (Stage::limit).
  std::optional<double> depth_limit;
  /// Side of the cells of the map, metres, where the configuration says it (Stage::resolution).
  std::optional<double> resolution;
  std::size_t points = 0;  ///< finite ones
  /// B and f of the calibration; its disparity error is the default.
  std::optional<StereoNoise> stereo;
  /// False for a cloud of many scans: rays from the origin of its frame mean nothing.
  bool has_sensor = true;
  bool optical = false;  ///< a camera's frame, z forward, see isCameraView()
  /// Of the world: the axis next to upwards in the images of a camera, else z.
  Vector3 up = Vector3::UnitZ();
};

/// The scale of the points that are listed, which must be finite; the sensor is at the origin of
/// their frame. O(n).
PLANAR_MAPPING_EXPORT CloudScale scaleOf(const PointsView& points, const Indices& indices,
                                         const Pose& T_world_sensor = Pose::Identity());

/// The vertical that a cloud suggests: if it is a camera's, the coordinate axis of the world next
/// to upwards in its image, else z. Upwards is the y, with its sign, that grows from the last row
/// to the first of an organized cloud whose columns and rows are those of a pinhole camera that
/// looks along z or -z; of other clouds with isCameraView() it is -y. O(points).
/// \param indices the points that count, or null for all
PLANAR_MAPPING_EXPORT Vector3 verticalOf(const PointsView& points, const Indices* indices,
                                         const Pose& T_world_sensor);
/// The coordinate axis, with its sign, next to a direction of any length.
PLANAR_MAPPING_EXPORT Vector3 nearestAxis(const Vector3& direction);
/// Whether a cloud is in a camera's frame, z forward: 99 % of it within 63 degrees of z. What is
/// not organized must not lie 10 m above its origin if that is one and a half extents, which a
/// camera sees within 37 degrees, or if it is merged: those are heights above the sea. O(points).
PLANAR_MAPPING_EXPORT bool isCameraView(const PointsView& points, const Indices* indices);

/// Whether a cloud cannot have been seen from the origin of its frame: it is merged from several
/// scans. That is so if a quarter of its points lie behind others, 1.5 times as far in the same
/// direction (of one degree), or a twelfth 1.12 times as far (of an eighth of a degree: seen from
/// outside), or 6 % 1.2 times as far as others on all four sides (a degree beside) and one in 200
/// in the same eighth of a degree (which the wires of a fence do not give), or if the origin is ten
/// extents away, or 10 m and one and a half extents below.
/// Organized clouds are of one scan. O(points). [ours]
/// \param indices the points that count, or null for all
PLANAR_MAPPING_EXPORT bool isMerged(const PointsView& points, const Indices* indices);

/// The points of a cloud as a sensor at \p origin, in the same coordinates, sees them: less the
/// origin, three floats a point; NaN where nothing was measured. O(points).
/// \throws InputError if the origin is not finite
PLANAR_MAPPING_EXPORT std::vector<float> seenFrom(const Vector3& origin, const PointsView& points);

/// A resolution that suits a cloud: the one given, else the nearest of 1, 2, 5 x 10^k metres to a
/// hundredth of the extent or three point spacings, the larger, at most 0.2 m, but at least two
/// (of more than 1 m three) and four times the noise; 0.1 for a cloud without extent. [ours]
PLANAR_MAPPING_EXPORT double automaticResolution(const CloudScale& scale);

/// Largest distance of an inlier from its plane, metres, that suits a cloud: half the resolution.
PLANAR_MAPPING_EXPORT double automaticThreshold(const CloudScale& scale);
/// Points of the smallest plane of a cloud that counts: a 300th of all, at least 50. [ours]
PLANAR_MAPPING_EXPORT int automaticSmallestPlane(const CloudScale& scale);

/// The points of a cloud that can be used: measured (PointsView::isMeasured), and no farther than
/// 1e12 along any axis, so that their squares stay finite in a float. Ascending; O(n).
/// \throws InputError for more than 2^31 - 1 points
PLANAR_MAPPING_EXPORT Indices usablePoints(const PointsView& points);

/// Spacing of the points, in distance thresholds, at which planes are no longer searched for.
constexpr double kMaxSpacingInThresholds = 100.0;

/// Refuses a cloud that is not in metres: each point stands for a surface more than \p max_spacing
/// wide, and 99 % of the points are more than 30 times that from the sensor (the origin).
/// \param indices      points that count, or null for all; those that are not finite are skipped
/// \param max_spacing  metres, > 0
/// \param parameters   that belong to it, for the message
/// \throws InputError saying what to do
/// Looks at 256 points of a usual cloud.
PLANAR_MAPPING_EXPORT void requireMetres(const PointsView& points, const Indices* indices,
                                         double max_spacing, const char* parameters);

}  // namespace planar_mapping
