// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/filters/impl/filter.hpp>
#include <pcl/filters/impl/filter_indices.hpp>
#include <pcl/impl/pcl_base.hpp>

#include <cmath>
#include <utility>

#include "planar_mapping/filters/detail/point_filter.h"

namespace planar_mapping::detail {

template <typename PointT>
PointFilter<PointT>::PointFilter(const PointFilter& other) : pcl::FilterIndices<PointT>(other) {
  unshare();
}

template <typename PointT>
PointFilter<PointT>& PointFilter<PointT>::operator=(const PointFilter& other) {
  if (this != &other) {
    pcl::FilterIndices<PointT>::operator=(other);
    unshare();
  }
  return *this;
}

// PCL copies the pointers, and then a run of the copy changes what the original returns.
template <typename PointT>
void PointFilter<PointT>::unshare() {
  this->removed_indices_ = pcl::IndicesPtr(new pcl::Indices(*this->removed_indices_));
  if (this->fake_indices_) this->indices_.reset();
}

template <typename PointT>
void PointFilter<PointT>::markNotMeasured(const PointsView& points, const Indices* indices,
                                          std::vector<std::uint8_t>& verdicts) {
  for (std::size_t k = 0; k < verdicts.size(); ++k) {
    const std::size_t i = indices ? static_cast<std::size_t>((*indices)[k]) : k;
    if (!points.isMeasured(i)) verdicts[k] = kInvalid;
  }
}

template <typename PointT>
void PointFilter<PointT>::applyFilter(pcl::Indices& indices) {
  this->removed_indices_->clear();
  const pcl::Indices& all = *this->indices_;
  const std::vector<std::uint8_t> verdicts =
      test(*this->input_, this->fake_indices_ ? nullptr : &all);
  const std::uint8_t wanted = this->negative_ ? kFails : kPasses;
  pcl::Indices kept(all.size());
  std::size_t count = 0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (verdicts[k] == wanted) {
      kept[count++] = all[k];
    } else if (this->extract_removed_indices_) {
      this->removed_indices_->push_back(all[k]);
    }
  }
  kept.resize(count);
  indices = std::move(kept);
}

template <typename PointT>
void PointFilter<PointT>::applyFilter(PointCloud& output) {
  output.clear();
  output.header = this->input_->header;
  output.sensor_origin_ = this->input_->sensor_origin_;
  output.sensor_orientation_ = this->input_->sensor_orientation_;
  pcl::Indices kept;
  if (!this->keep_organized_) {
    applyFilter(kept);
    output.points.reserve(kept.size());
    for (const int i : kept) output.points.push_back(this->input_->points[i]);
    output.width = static_cast<std::uint32_t>(kept.size());
    output.height = 1;
    output.is_dense = true;
    return;
  }
  // The removed points are needed here, whether or not the caller asked for them.
  const bool extract = std::exchange(this->extract_removed_indices_, true);
  try {
    applyFilter(kept);
  } catch (...) {
    this->extract_removed_indices_ = extract;
    throw;
  }
  this->extract_removed_indices_ = extract;
  output = *this->input_;
  const float value = this->user_filter_value_;
  for (const int i : *this->removed_indices_) {
    output.points[i].x = output.points[i].y = output.points[i].z = value;
  }
  if (!this->removed_indices_->empty() && !std::isfinite(value)) output.is_dense = false;
  if (!extract) this->removed_indices_->clear();
}

}  // namespace planar_mapping::detail
