// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/filters/statistical_outlier_removal.h>

#include <algorithm>

#include "builtin.h"

namespace planar_mapping {
namespace {

/// Runs a PCL filter that searches neighbours on a copy of the points that count: in an organized
/// cloud PCL would search the image, which needs a projection matrix that a cloud may not have.
template <typename Filter>
void filterCompact(Filter& filter, bool negative, Frame& frame) {
  if (frame.indices.empty()) return;
  filter.setInputCloud(pcl::make_shared<FrameCloud>(*frame.cloud, frame.indices));
  filter.setNegative(negative);
  pcl::Indices kept;
  filter.filter(kept);
  std::sort(kept.begin(), kept.end());
  for (int& i : kept) i = frame.indices[static_cast<std::size_t>(i)];
  frame.indices = std::move(kept);
}

class StatisticalOutlierRemovalStage : public Stage {
 public:
  static constexpr const char* kName = "statistical_outlier_removal";
  static constexpr const char* kSummary = "drops points farther from their neighbours than most";
  static constexpr StageKind kKind = StageKind::Points;

  void declare(ParameterTable& table) override {
    table.integer("neighbors", neighbors_, Range::between(1, 1000), "neighbours looked at");
    table.number("deviations", deviations_, Range::positive(),
                 "standard deviations above the mean distance that are still kept");
    table.flag("negative", negative_, "keep the outliers instead");
  }
  void process(Frame& frame) override {
    pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
    filter.setMeanK(neighbors_);
    filter.setStddevMulThresh(deviations_);
    filterCompact(filter, negative_, frame);
  }

 private:
  int neighbors_ = 30;
  double deviations_ = 2.0;
  bool negative_ = false;
};

class RadiusOutlierRemovalStage : public Stage {
 public:
  static constexpr const char* kName = "radius_outlier_removal";
  static constexpr const char* kSummary = "drops points with too few neighbours around them";
  static constexpr StageKind kKind = StageKind::Points;

  void declare(ParameterTable& table) override {
    table.number("radius_m", radius_, Range::positive(), "radius of the neighbourhood");
    table.integer("min_neighbors", min_neighbors_, Range::atLeast(1), "neighbours needed");
    table.flag("negative", negative_, "keep the outliers instead");
  }
  void process(Frame& frame) override {
    pcl::RadiusOutlierRemoval<pcl::PointXYZ> filter;
    filter.setRadiusSearch(radius_);
    filter.setMinNeighborsInRadius(min_neighbors_);
    filterCompact(filter, negative_, frame);
  }

 private:
  double radius_ = 0.1;
  int min_neighbors_ = 4;
  bool negative_ = false;
};

}  // namespace

void detail::addOutlierFilters(StageTable& table) {
  table.add<StatisticalOutlierRemovalStage>();
  table.add<RadiusOutlierRemovalStage>();
}

}  // namespace planar_mapping
