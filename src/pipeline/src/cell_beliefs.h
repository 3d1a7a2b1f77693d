// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/core/kl_update.h"
#include "planar_mapping/core/occupancy.h"

namespace planar_mapping::detail {

struct CellBeliefParams {
  OccupancyParams occupancy;
  KlUpdateParams update;
  double resolution = 0.1;    ///< s, metres
  int features_per_cell = 8;  ///< sampled in each cell of each plane
  int max_unseen_frames = 0;  ///< older cells are forgotten; 0 = never
};

/// Beliefs of the cells of a grid fixed in the world: what Eq. 4 to 10 (the paper) say of features
/// that are sampled from a cloud and keep the cell as identity. With known poses (Eq. 9 is 1) this
/// is what KlOccupancy does with tracks, with one look-up a cell instead of several a point.
class CellBeliefs {
 public:
  struct Summary {
    std::size_t created = 0;  ///< cells seen for the first time
    std::size_t updated = 0;  ///< cells seen again
  };

  void setParams(const CellBeliefParams& params) { params_ = params; }
  /// One frame.
  /// \param labels       plane per point of the cloud, negative = none: the group of Eq. 4 is the
  ///                     cell of one plane
  /// \param probability  per point of the cloud: that of \p indices is set, to the belief in their
  ///                     cell; single_feature_probability beyond a million cells
  Summary update(const PointsView& points, const Indices& indices,
                 const std::vector<std::int32_t>& labels, const Pose& T_world_sensor,
                 std::vector<float>& probability);

 private:
  struct Slot {
    std::uint64_t cell = 0;   ///< kNoCell = free
    std::int32_t label = -1;  ///< of the plane
    std::int32_t number = -1;
  };
  struct Group {
    std::uint64_t cell;
    std::int32_t features;
  };
  struct Belief {
    std::uint64_t cell;
    double value;
    std::int64_t frame;  ///< when last seen
  };

  void findCells(const PointsView& points, const Indices& indices, const Pose& T_world_sensor);
  void sampleFeatures(const Indices& indices, const std::vector<std::int32_t>& labels);
  std::int32_t groupOf(std::uint64_t cell, std::int32_t label);
  void growGroups();
  Summary updateBeliefs(const PointsView& points, const Vector3& sensor);
  Belief& beliefOf(std::uint64_t cell);
  void rebuildBeliefs();

  CellBeliefParams params_;
  std::vector<Belief> beliefs_;  ///< open addressing, power of two
  std::size_t known_ = 0;
  std::int64_t frame_ = 0;

  // Of the frame; kept for their memory.
  std::vector<std::uint64_t> cells_;  ///< per point that counts
  std::vector<std::int32_t> groups_;  ///< per point that counts
  std::vector<Slot> slots_;
  std::vector<Group> group_list_;
  Indices features_;
  std::vector<std::int32_t> feature_groups_;
  std::vector<float> group_belief_;
};

}  // namespace planar_mapping::detail
