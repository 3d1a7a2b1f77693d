// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/beliefs/feature_beliefs.h"
#include "planar_mapping/geometry/camera.h"

namespace planar_mapping {

/// Where the features of KlOccupancy come from.
enum class FeatureSource : std::uint8_t {
  Auto,    ///< Tracks in frames that have tracked features, else Cells
  Tracks,  ///< key features or points with a track; their tracks are the identities over frames
  Cells,   ///< [ours] points sampled in each cell of a grid fixed in the world, the identity
};

/// Parameters of KlOccupancy. Lengths in metres.
struct PLANAR_MAPPING_EXPORT KlOccupancyParams {
  FeatureBeliefParams beliefs;  ///< Eq. 4 to 10, motion reading, update rule
  /// [ours] Direction of depth, instead of OccupancyParams::optical_axis, which is not used; zero =
  /// depth is the range (laser scanners); absent = z if the first cloud is a camera's
  /// (isCameraView()), else zero.
  std::optional<Vector3> optical_axis;
  FeatureSource source = FeatureSource::Auto;
  double resolution = 0.1;  ///< s, side of the grid cell whose features make a group, > 0
  /// [ours] dr of Eq. 4 is at least this many cells, >= 0; 0 = the paper. See
  /// OccupancyParams::min_range_error.
  double range_floor_cells = 0.5;
  int features_per_cell = 8;  ///< [ours] points sampled in each cell of each plane, >= 1
  /// [ours] Eq. 4 is over a tracked feature and the sampled points of its cell, so that a feature
  /// alone in its cell has a group; false = over features only (the paper).
  bool dense_groups = true;
  /// [ours] false: a belief below 0.5 spreads to adjacent cells only where no feature believed
  /// more is within reach, so that one wrong match takes one cell from a wall; true = all beliefs
  /// spread alike.
  bool doubt_spreads = false;
  double min_probability = 0.5;  ///< [ours] for filters: points believed less go, in [0, 1]
  int threads = 1;               ///< 0 = all cores; never changes the result

  /// \throws ParameterError
  void validate() const;
};

/// A frame as KlOccupancy takes it. Vectors hold one value per point of the cloud.
struct OccupancyFrame {
  PointsView points;                 ///< in the sensor's frame
  const Indices* indices = nullptr;  ///< the points that count; null = all
  /// Pose of the sensor; absent = unknown: cells are then those of a grid at the sensor.
  std::optional<Pose> T_world_sensor;
  /// Plane of each point, negative = none: the group of Eq. 4 is the grid cell of one plane.
  const std::vector<std::int32_t>* plane_labels = nullptr;
  /// Features of the frame's images; those with a track, a finite position and a cell count. A
  /// feature belongs to the cell of the point at its pixel (organized clouds) where the two agree
  /// within a cell or three times the depth error, else to the cell it lies in, on no plane.
  const std::vector<KeyFeature>* key_features = nullptr;
  /// Points that are features themselves: the track of each point, negative = none.
  const std::vector<std::int64_t>* tracks = nullptr;
  /// Since the frame before; absent = from the poses of both frames, where they are known.
  std::optional<FrameMotion> motion;
};

/// What KlOccupancy::update() did.
struct KlOccupancyDiagnostics {
  FeatureSource source = FeatureSource::Cells;  ///< Tracks or Cells, the one that was used
  std::size_t points_considered = 0;
  std::size_t points_not_measured = 0;
  /// Of features, or of the cells that stand for them.
  FeatureBeliefs::Summary beliefs;
  // Tracks only.
  std::size_t features_ignored = 0;     ///< without a track, not finite or out of the grid
  std::size_t cells_of_features = 0;    ///< with features in them
  std::size_t cells_of_neighbours = 0;  ///< that took the mean of adjacent cells
  std::size_t cells_of_points = 0;      ///< out of reach of any feature: Eq. 4 of their points
};

/// Probability of every point of a frame from features seen over several frames (the paper, III-D,
/// III-E and IV, Eq. 4 to 10): the engine of KLOccupancyFilter and of the stage `kl_occupancy`.
///
/// With tracks, a grid cell of a plane has the mean belief of the features in it; without any, the
/// mean of the adjacent cells that have one, ring by ring; where no feature is within reach, Eq. 4
/// of its points. Without tracks, features are sampled from the points, and the cell is their
/// identity: the observation of a cell is the mean of Eq. 4 over its samples, the motion factor 1.
/// [ours] A cell seen again by a point alone keeps its belief where the cloud is so sparse that
/// more than 2 % of the points on planes at that range are alone: Eq. 4 has no spread there, and
/// Eq. 10 would take it for doubt.
///
/// Keeps beliefs between frames. Copyable. Not thread safe. A moved-from object is an empty one.
class PLANAR_MAPPING_EXPORT KlOccupancy {
 public:
  explicit KlOccupancy(const KlOccupancyParams& params = KlOccupancyParams());
  ~KlOccupancy();
  KlOccupancy(const KlOccupancy& other);
  KlOccupancy(KlOccupancy&& other) noexcept;
  KlOccupancy& operator=(const KlOccupancy& other);
  KlOccupancy& operator=(KlOccupancy&& other) noexcept;

  /// Takes effect from the next frame on; beliefs stay.
  /// \throws ParameterError
  void setParams(const KlOccupancyParams& params);
  const KlOccupancyParams& params() const;

  /// One frame. O(points + cells).
  /// \param probability  becomes one value in [0, 1] per point of the cloud: the belief in its cell
  ///     or, for a point with a track, in that; single_feature_probability beyond a million cells
  ///     from the sensor; 0 for points that are not finite or not among the indices
  /// \throws InputError for an index outside the cloud, sizes that disagree or a pose that is not
  ///     finite; ParameterError for a covariance that is none; beliefs are then unchanged
  KlOccupancyDiagnostics update(const OccupancyFrame& frame, std::vector<float>& probability);

  /// Beliefs of all tracks known.
  const FeatureBeliefs& tracks() const;
  /// Forgets all beliefs; parameters stay.
  void reset();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace planar_mapping
