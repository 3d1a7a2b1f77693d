// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/occupancy/feature_beliefs.h"
#include "planar_mapping/core/geometry/key_feature.h"
#include "planar_mapping/core/base/types.h"

namespace planar_mapping {

/// Parameters of KeyFeatureBeliefs. Lengths in metres.
struct PLANAR_MAPPING_EXPORT KeyFeatureBeliefParams {
  FeatureBeliefParams beliefs;  ///< Eq. 4 to 10, motion reading, update rule
  double resolution = 0.1;      ///< s, side of a grid cell, > 0
  /// [ours] Eq. 4 judges a feature together with the dense points of its cell, so that a feature
  /// alone in its cell has a group; false = among features only (the paper).
  bool dense_groups = true;
  /// [ours] Doubt in a feature (belief below 0.5) spreads to adjacent cells only where no believed
  /// feature is within reach: one wrong match takes one cell from a wall, not the wall around it.
  /// true = all features spread alike.
  bool doubt_spreads = false;
  int dense_per_cell = 8;  ///< [ours] dense points sampled in each cell of each plane, >= 1
  int threads = 1;         ///< 0 = all cores; never changes the result

  /// \throws ParameterError
  void validate() const;
};

/// Beliefs of the dense points of a frame from its key features (the paper, III-D, III-E and IV):
/// features are followed by their tracks (FeatureBeliefs); a grid cell of a plane has the mean
/// belief of the features in it, without any that of the adjacent cells that have one, ring by
/// ring; where no feature is within reach, Eq. 4 over its dense points. Cells are those of a grid
/// fixed in the world. Copyable. Not thread safe.
class PLANAR_MAPPING_EXPORT KeyFeatureBeliefs {
 public:
  struct Frame {
    PointsView points;                                  ///< relative to the sensor
    const Indices* indices = nullptr;                   ///< the points that count, ascending
    const std::vector<std::int32_t>* labels = nullptr;  ///< plane per point of the cloud, or < 0
    Pose T_world_sensor = Pose::Identity();
    const std::vector<KeyFeature>* features = nullptr;
    std::optional<FrameMotion> motion;  ///< since the frame before; absent = unknown
  };
  struct Summary {
    FeatureBeliefs::Summary features;
    std::size_t features_ignored = 0;     ///< without a track, not finite or out of the grid
    std::size_t cells_of_features = 0;    ///< with features in them
    std::size_t cells_of_neighbours = 0;  ///< took the mean of adjacent cells
    std::size_t cells_of_points = 0;      ///< judged by their dense points
  };

  explicit KeyFeatureBeliefs(const KeyFeatureBeliefParams& params = KeyFeatureBeliefParams());
  ~KeyFeatureBeliefs();
  KeyFeatureBeliefs(const KeyFeatureBeliefs& other);
  KeyFeatureBeliefs(KeyFeatureBeliefs&& other) noexcept;
  KeyFeatureBeliefs& operator=(const KeyFeatureBeliefs& other);
  KeyFeatureBeliefs& operator=(KeyFeatureBeliefs&& other) noexcept;

  /// Takes effect from the next frame on; beliefs stay.
  /// \throws ParameterError
  void setParams(const KeyFeatureBeliefParams& params);
  const KeyFeatureBeliefParams& params() const;

  /// One frame. O(points + cells).
  /// A feature belongs to the cell of the dense point at its pixel where the two agree within a
  /// cell or three times the depth error, else to the cell it lies in, on no plane.
  /// \param probability  per point of the cloud: that of the indices is set
  /// \throws InputError for an index outside the cloud, sizes that disagree or a missing input;
  ///         ParameterError for a covariance that is none; beliefs are then unchanged
  Summary update(const Frame& frame, std::vector<float>& probability);

  const FeatureBeliefs& beliefs() const;
  /// Forgets all beliefs.
  void clear();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace planar_mapping
