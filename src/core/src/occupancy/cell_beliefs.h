// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "grid/frame_cells.h"
#include "occupancy/dense_features.h"
#include "planar_mapping/core/occupancy/feature_beliefs.h"

namespace planar_mapping::detail {

/// Beliefs of the cells of a grid fixed in the world (Eq. 10): what FeatureBeliefs says of samples
/// whose track is their cell, at the price of one look-up a cell instead of several a point.
class CellBeliefs {
 public:
  std::size_t size() const { return known_.size(); }

  /// One frame.
  /// \param support   Eq. 4 of the samples of each group
  /// \param of_group  becomes the belief in the cell of each group
  FeatureBeliefs::Summary update(const std::vector<FrameCells::Group>& groups,
                                 const DenseFeatures& support, const FeatureBeliefParams& params,
                                 std::vector<float>& of_group);
  template <typename Archive>
  void visitState(Archive& archive) {
    archive(known_, frame_);
  }

 private:
  struct Belief {
    double value = 0.0;
    std::int64_t frame = 0;  ///< when last seen
  };

  std::unordered_map<std::uint64_t, Belief> known_;  ///< by cell
  std::int64_t frame_ = 0;
  std::vector<std::int32_t> order_;  ///< groups by cell; kept for its memory
};

}  // namespace planar_mapping::detail
