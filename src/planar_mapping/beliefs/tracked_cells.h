// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/beliefs/dense_features.h"
#include "planar_mapping/beliefs/kl_occupancy.h"
#include "planar_mapping/grid/frame_cells.h"

namespace planar_mapping::detail {

/// Beliefs of the cells of a frame from the tracked features in them (the paper, III-D, III-E, IV).
class TrackedCells {
 public:
  /// One frame.
  /// \param indices   the points that count, in the groups of \p cells
  /// \param cells     features in cells without points add theirs
  /// \param dense     samples of the groups; Eq. 4 is asked for where no feature is within reach
  /// \param occupancy with the floor of the range error
  /// \param of_group  becomes the belief in each group that has points
  void update(const OccupancyFrame& frame, const Indices& indices,
              const std::optional<FrameMotion>& motion, const KlOccupancyParams& params,
              const OccupancyParams& occupancy, FrameCells& cells, DenseFeatures& dense,
              FeatureBeliefs& beliefs, KlOccupancyDiagnostics& report,
              std::vector<float>& of_group);

 private:
  void collect(const OccupancyFrame& frame, const Indices& indices, double resolution,
               const OccupancyParams& occupancy, FrameCells& cells);
  void add(std::int64_t track, const Vector3& position, std::int32_t group);
  void observe(const OccupancyFrame& frame, const OccupancyParams& occupancy,
               const DenseFeatures* dense, std::size_t groups);
  void findNeighbours(const FrameCells& cells);
  void spread(std::vector<std::size_t> ring);
  void spreadBelieved();

  // Of the frame; kept for their memory.
  std::size_t considered_ = 0;                         ///< features, also those left out
  std::vector<FeatureBeliefs::Observation> features_;  ///< those that can be followed
  std::vector<std::int32_t> groups_;                   ///< of each feature
  std::vector<double> values_;                         ///< belief per group, -1 = none yet
  std::vector<std::vector<std::size_t>> beside_;       ///< adjacent groups on the same plane
};

}  // namespace planar_mapping::detail
