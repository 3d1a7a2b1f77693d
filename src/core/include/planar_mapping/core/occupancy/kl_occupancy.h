// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/occupancy/feature_beliefs.h"
#include "planar_mapping/core/base/types.h"

namespace planar_mapping {

/// Parameters of KlOccupancy. Lengths in metres.
struct PLANAR_MAPPING_EXPORT KlOccupancyParams {
  FeatureBeliefParams beliefs;
  double resolution = 0.1;  ///< s, side of the grid cell whose features make a group, > 0
  /// [ours] dr of Eq. 4 is at least this many cells, >= 0; 0 = the paper. See
  /// OccupancyParams::min_range_error.
  double range_floor_cells = 0.5;
  double min_probability = 0.5;  ///< [ours] points believed less than this are noise, in [0, 1]

  /// \throws ParameterError
  void validate() const;
};

/// A frame as KlOccupancy takes it. Vectors hold one value per point of the cloud.
struct OccupancyFrame {
  PointsView points;
  Vector3 sensor = Vector3::Zero();  ///< position of the sensor, in the frame of the points
  const Indices* indices = nullptr;  ///< the points that count; null = all
  /// Identity of each feature, negative = untracked; null = all untracked.
  const std::vector<std::int64_t>* tracks = nullptr;
  /// Plane of each point, negative = none: the group of Eq. 4 is the grid cell of one plane.
  const std::vector<std::int32_t>* plane_labels = nullptr;
  /// Group of each point, negative = its own: instead of the grid.
  const std::vector<std::int32_t>* groups = nullptr;
  /// Since the frame before, for coordinates relative to the sensor; absent = unknown.
  std::optional<FrameMotion> motion;
};

/// What KlOccupancy::process() did.
struct KlOccupancyDiagnostics {
  std::size_t points_considered = 0;
  std::size_t points_not_finite = 0;   ///< or beyond FeatureBeliefs::kFarthest
  std::size_t tracked = 0;             ///< judged by their track
  std::size_t from_features = 0;       ///< took the probability of the features around them
  std::size_t from_dense_support = 0;  ///< no feature within reach: Eq. 4 over the dense points
  FeatureBeliefs::Summary beliefs;
};

/// Probability of every point of a frame from features seen over several frames (the paper, III-D,
/// III-E, IV): tracked points by FeatureBeliefs, the others by the features in their grid cell or
/// around it, else by Eq. 4 over the dense points of their cell.
/// Keeps beliefs between frames. Copyable. Not thread safe.
class PLANAR_MAPPING_EXPORT KlOccupancy {
 public:
  explicit KlOccupancy(const KlOccupancyParams& params = KlOccupancyParams());

  /// \throws ParameterError
  void setParams(const KlOccupancyParams& params);
  const KlOccupancyParams& params() const { return params_; }

  /// One frame.
  /// \return one probability in [0, 1] per point that counts, in its order; 0 for non-finite ones
  /// \throws InputError, ParameterError; beliefs are then unchanged
  std::vector<float> process(const OccupancyFrame& frame,
                             KlOccupancyDiagnostics* diagnostics = nullptr);

  const FeatureBeliefs& beliefs() const { return beliefs_; }
  /// Forgets all beliefs.
  void reset() { beliefs_.clear(); }

 private:
  KlOccupancyParams params_;
  FeatureBeliefs beliefs_;
};

}  // namespace planar_mapping
