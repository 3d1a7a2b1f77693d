// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "planar_mapping/core/occupancy/detail/belief_update.h"
#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/occupancy/occupancy.h"
#include "planar_mapping/core/base/types.h"

namespace planar_mapping {

/// Parameters of CellBeliefs.
struct PLANAR_MAPPING_EXPORT CellBeliefParams {
  OccupancyParams occupancy;
  BeliefUpdateParams update;
  double resolution = 0.1;    ///< s, side of a cell, metres, > 0
  int features_per_cell = 8;  ///< [ours] sampled in each cell of each plane, >= 1
  /// [ours] Cells not seen for this many frames are forgotten; 0 = never.
  int max_unseen_frames = 0;
  int threads = 1;  ///< 0 = all cores; never changes the result

  /// \throws ParameterError
  void validate() const;
};

/// Beliefs of the cells of a grid fixed in the world, for clouds that come without key features:
/// what Eq. 4 to 10 (the paper) say of features sampled from the cloud that keep the cell they lie
/// in as identity. The arithmetic is that of FeatureBeliefs with the cell as track and a motion
/// factor of 1 (poses are known), at the price of one look-up a cell instead of several a point.
/// Copyable. Not thread safe.
class PLANAR_MAPPING_EXPORT CellBeliefs {
 public:
  struct Summary {
    std::size_t created = 0;  ///< cells seen for the first time
    std::size_t updated = 0;  ///< cells seen again
  };

  explicit CellBeliefs(const CellBeliefParams& params = CellBeliefParams());
  ~CellBeliefs();
  CellBeliefs(const CellBeliefs& other);
  CellBeliefs(CellBeliefs&& other) noexcept;
  CellBeliefs& operator=(const CellBeliefs& other);
  CellBeliefs& operator=(CellBeliefs&& other) noexcept;

  /// Takes effect from the next frame on; beliefs stay.
  /// \throws ParameterError
  void setParams(const CellBeliefParams& params);
  const CellBeliefParams& params() const;

  /// One frame. O(points).
  /// \param points       relative to the sensor, metres
  /// \param indices      the points that count
  /// \param labels       plane per point of the cloud, negative = none: the group of Eq. 4 is the
  ///                     cell of one plane
  /// \param probability  per point of the cloud: that of \p indices is set, to the belief in their
  ///                     cell; single_feature_probability beyond a million cells from the sensor
  ///                     and for points that are not finite
  /// \throws InputError for an index outside the cloud or sizes that disagree; beliefs are then
  ///         unchanged
  Summary update(const PointsView& points, const Indices& indices,
                 const std::vector<std::int32_t>& labels, const Pose& T_world_sensor,
                 std::vector<float>& probability);
  /// Cells known.
  std::size_t size() const;
  /// Forgets all beliefs.
  void clear();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace planar_mapping
