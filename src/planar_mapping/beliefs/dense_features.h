// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/beliefs/occupancy.h"
#include "planar_mapping/grid/frame_cells.h"

namespace planar_mapping::detail {

/// Points sampled from each group of a frame, and Eq. 4 over the samples of a group.
class DenseFeatures {
 public:
  struct Support {
    double sum = 0.0;        ///< of Eq. 4
    std::int32_t count = 0;  ///< of the points sampled
    bool sparse = false;     ///< a point alone where even on planes many are
  };

  /// The first points of each group, as the indices come.
  void sample(const Indices& indices, const FrameCells& cells, int per_group);
  /// Eq. 4; the points are relative to the sensor.
  /// \param known beliefs of groups, not negative where the support is not asked for; null = none
  void observe(const PointsView& points, const OccupancyParams& params,
               const std::vector<double>* known = nullptr);
  /// Finds which groups are sparse. \param points  relative to the sensor
  void findSparse(const PointsView& points, const FrameCells& cells);
  const Support& support(std::int32_t group) const {
    return support_[static_cast<std::size_t>(group)];
  }
  const Indices& points() const { return points_; }
  const std::vector<std::int32_t>& groups() const { return groups_; }

 private:
  Indices points_;
  std::vector<std::int32_t> groups_;
  std::vector<Support> support_;
};

}  // namespace planar_mapping::detail
