// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/point_cloud.h>

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include "planar_mapping/base/types.h"

namespace planar_mapping {

/// The x, y, z of a pcl::PointCloud as the core library reads them: in place where a point holds
/// them as three floats in a row (every type of PCL does), else through a copy that it keeps.
///
/// The cloud must outlive the view and keep its size. Only p.x, p.y and p.z are read.
class CloudView {
 public:
  /// A view in place.
  explicit CloudView(const PointsView& points) : points_(points) {}
  /// A view of \p packed, xyz triples, which it keeps; shape as in \p shape.
  CloudView(std::vector<float> packed, const PointsView& shape)
      : packed_(std::move(packed)), points_(shape) {
    points_.data = packed_.data();
    points_.stride = 3;
  }
  CloudView(CloudView&&) = default;
  CloudView& operator=(CloudView&&) = default;
  CloudView(const CloudView&) = delete;
  CloudView& operator=(const CloudView&) = delete;

  const PointsView& points() const { return points_; }
  operator const PointsView&() const { return points_; }  // NOLINT: meant to be implicit

 private:
  std::vector<float> packed_;
  PointsView points_;
};

namespace detail {

/// Distance of member \p m from the start of \p p, bytes. A run-time offsetof, because PCL's point
/// types are not all of standard layout.
template <typename PointT, typename MemberT>
std::ptrdiff_t memberOffset(const PointT& p, const MemberT& m) {
  return reinterpret_cast<const char*>(&m) - reinterpret_cast<const char*>(&p);
}

}  // namespace detail

/// The cloud as a PointsView, organized if width * height is its size and height > 1.
template <typename PointT>
CloudView viewOf(const pcl::PointCloud<PointT>& cloud) {
  PointsView shape;
  shape.size = cloud.points.size();
  const bool grid = static_cast<std::size_t>(cloud.width) * cloud.height == shape.size;
  shape.width = grid ? cloud.width : static_cast<std::uint32_t>(shape.size);
  shape.height = grid ? cloud.height : (shape.size > 0 ? 1 : 0);
  if (shape.size == 0) return CloudView(shape);

  const PointT& first = cloud.points.front();
  constexpr bool all_float = std::is_same_v<std::decay_t<decltype(first.x)>, float> &&
                             std::is_same_v<std::decay_t<decltype(first.y)>, float> &&
                             std::is_same_v<std::decay_t<decltype(first.z)>, float>;
  if constexpr (all_float && sizeof(PointT) % sizeof(float) == 0) {
    const std::ptrdiff_t x = detail::memberOffset(first, first.x);
    if (detail::memberOffset(first, first.y) == x + static_cast<std::ptrdiff_t>(sizeof(float)) &&
        detail::memberOffset(first, first.z) ==
            x + static_cast<std::ptrdiff_t>(2 * sizeof(float))) {
      shape.data = reinterpret_cast<const float*>(reinterpret_cast<const char*>(&first) + x);
      shape.stride = sizeof(PointT) / sizeof(float);
      return CloudView(shape);
    }
  }
  std::vector<float> packed;
  packed.reserve(3 * shape.size);
  for (const PointT& p : cloud.points) {
    packed.push_back(static_cast<float>(p.x));
    packed.push_back(static_cast<float>(p.y));
    packed.push_back(static_cast<float>(p.z));
  }
  return CloudView(std::move(packed), shape);
}

/// A temporary cloud would leave the view dangling.
template <typename PointT>
CloudView viewOf(const pcl::PointCloud<PointT>&& cloud) = delete;

}  // namespace planar_mapping
