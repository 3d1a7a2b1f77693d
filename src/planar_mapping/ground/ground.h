// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/geometry/plane.h"

namespace planar_mapping {

/// Parameters of findGround() and GroundTracker. Lengths in metres, angles in radians; all of them
/// [ours]: the paper (III-F, assumption 2) only says that ground points are removed.
struct PLANAR_MAPPING_EXPORT GroundParams {
  static constexpr double kPaperCameraHeight = 0.37;
  /// Height of the sensor over the ground, >= 0. Absent or 0 = unknown: the ground is then the
  /// lowest dominant plane within the tolerances below the sensor. GroundTracker expects an absent
  /// height by the frames before; 0 is unknown anew in every frame.
  std::optional<double> camera_height;
  double height_tolerance = 0.15;  ///< of the height, given or expected, > 0
  /// Upwards, need not have unit length: in the frame of the cloud for findGround(), of the world
  /// for GroundTracker. Absent = verticalOf() the cloud.
  std::optional<Vector3> up;
  /// The direction the camera looks in, in the cloud's frame; depth of the noise model is measured
  /// along it. Where it is parallel to up, pitch turns about y and depth is the distance.
  Vector3 optical_axis = Vector3::UnitZ();
  double pitch_tolerance = M_PI / 12.0;  ///< about the lateral axis, in (0, pi/2)
  double roll_tolerance = M_PI / 18.0;   ///< about the axis forwards, in (0, pi/2)
  double distance_threshold = 0.03;      ///< points this close to the ground belong to it, > 0
  /// The threshold follows the noise: max(distance_threshold, noise_factor * h * z / (B f) * dd),
  /// the part of the depth error that is across the ground at height h below the camera.
  std::optional<StereoNoise> noise;
  double noise_factor = 3.0;  ///< >= 0
  /// Side of the cells in which the ground may bend (slopes); 0 = one plane only.
  double slope_cell = 1.0;
  double max_slope =
      M_PI / 9.0;  ///< steepest ground, against the plane at the sensor, in [0, pi/2)
  /// A surface that continues at least this far above the threshold is no ground, nor is its foot;
  /// 0 = feet are not looked for.
  double wall_height = 0.15;
  double wall_cell = 0.1;             ///< side of the column in which that is decided, > 0
  double wall_foot_threshold = 0.01;  ///< the threshold in a column with a wall, > 0
  double min_fraction = 0.02;  ///< fraction of the finite points that must support it, in (0, 1]
  int min_points = 100;        ///< that must support it, >= 3
  int sample_size = 8192;      ///< points the estimate looks at, >= 100; labels look at all
  std::uint64_t seed = 12345;
  int threads = 1;  ///< for the labels; 0 = all cores; never changes the result

  /// \throws ParameterError
  void validate() const;
};

/// Why there is no ground.
enum class GroundStatus : std::uint8_t {
  Found,
  TooFewPoints,      ///< fewer than min_points finite points
  NoPlane,           ///< nothing within height and angle tolerance
  TooLittleSupport,  ///< a plane, but fewer points lie flat on it than min_fraction and min_points
                     ///< ask
  Elsewhere,         ///< GroundTracker: level, but not where the ground of the frames before is
};

/// "found", "too few points", ...
PLANAR_MAPPING_EXPORT const char* toString(GroundStatus status);

struct GroundDiagnostics {
  GroundStatus status = GroundStatus::TooFewPoints;
  std::size_t points_considered = 0;
  std::size_t points_not_measured = 0;
  std::size_t hypotheses = 0;  ///< that were scored
  std::size_t ground_points = 0;
  std::size_t wall_foot_points = 0;  ///< close to the ground, kept as foot of something higher
  std::size_t slope_cells = 0;       ///< in which the ground was followed
};

/// The ground of one frame.
struct Ground {
  bool found = false;
  Plane plane;                           ///< at the sensor, normal upwards; cloud's frame
  Matrix4 covariance = Matrix4::Zero();  ///< of (a, b, c, d)
  double rms = 0.0;                      ///< of the sampled points on it, metres
  double height = 0.0;                   ///< of the sensor over it, metres
  /// 1 = ground, 0 = not; one per point that counts, in its order. All 0 where none was found.
  std::vector<std::uint8_t> is_ground;
  GroundDiagnostics diagnostics;
};

/// Finds the ground of a frame and the points on it. O(points), from a fixed-size sample; the
/// result does not depend on anything but the arguments.
/// \param points  relative to the sensor; non-finite ones are skipped and counted
/// \param indices the points that count, or null for all
/// \throws ParameterError for bad parameters; InputError for an index outside the cloud
PLANAR_MAPPING_EXPORT Ground findGround(const PointsView& points, const Indices* indices,
                                        const GroundParams& params);

/// Follows the ground over the frames of a sensor whose pose is known: the engine of GroundRemoval
/// and of the stage `ground_removal`.
///
/// Where GroundParams::camera_height is absent, a frame is expected to have its ground at the
/// height above the world's ground that its pose says, so that a table is not taken for the floor;
/// slopes and drift are followed. Five frames that agree say where the ground is, at first or anew
/// where it is not found as expected. Copyable. Not thread safe.
class PLANAR_MAPPING_EXPORT GroundTracker {
 public:
  explicit GroundTracker(const GroundParams& params = GroundParams()) { setParams(params); }

  /// Takes effect from the next frame on; what is known of the ground stays.
  /// \throws ParameterError
  void setParams(const GroundParams& params);
  const GroundParams& params() const { return params_; }

  /// One frame.
  /// \param points  in the sensor's frame
  /// \return the ground in the sensor's frame
  /// \throws InputError for an index outside the cloud or a pose that is not finite
  Ground update(const PointsView& points, const Indices* indices,
                const Pose& T_world_sensor = Pose::Identity());
  /// Forgets where the ground is; parameters stay.
  void reset() { *this = GroundTracker(params_); }

 private:
  Ground findExpected(const PointsView& points, const Indices* indices, double altitude,
                      GroundParams params);
  void learn(double level);

  GroundParams params_;
  std::optional<Vector3> up_;    ///< of the world, unit length
  std::optional<double> level_;  ///< of the ground, along the vertical of the world
  std::vector<double> levels_;   ///< of the last frames whose ground is not at level_
};

}  // namespace planar_mapping
