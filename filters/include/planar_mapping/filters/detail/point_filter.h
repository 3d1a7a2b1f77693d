// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/filters/filter_indices.h>

#include <cstdint>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping::detail {

/// What a filter says of a point.
enum Verdict : std::uint8_t {
  kPasses = 0,   ///< kept, or removed by setNegative(true)
  kFails = 1,    ///< removed, or kept by setNegative(true)
  kInvalid = 2,  ///< not finite: removed either way, as PCL's filters do
};

/// What pcl::FilterIndices leaves to its derived classes, done once: indices, negative, removed
/// indices, organized output, without output on the console; and copies that share no state.
template <typename PointT>
class PLANAR_MAPPING_EXPORT PointFilter : public pcl::FilterIndices<PointT> {
 public:
  using PointCloud = typename pcl::FilterIndices<PointT>::PointCloud;

 protected:
  explicit PointFilter(bool extract_removed_indices)
      : pcl::FilterIndices<PointT>(extract_removed_indices) {}
  PointFilter(const PointFilter& other);
  PointFilter& operator=(const PointFilter& other);
  ~PointFilter() override = default;

  /// One Verdict per point that counts, in its order.
  /// \param indices the points that count, null for all
  virtual std::vector<std::uint8_t> test(const PointCloud& cloud, const Indices* indices) = 0;

  /// Makes the verdicts on points that are no measurement kInvalid.
  static void markNotMeasured(const PointsView& points, const Indices* indices,
                              std::vector<std::uint8_t>& verdicts);

  void applyFilter(pcl::Indices& indices) override;
  void applyFilter(PointCloud& output) override;

 private:
  void unshare();
};

}  // namespace planar_mapping::detail

#include "planar_mapping/filters/impl/point_filter.hpp"
