// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/filters/crop_box.h>
#include <pcl/filters/passthrough.h>

#include "builtin.h"
#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

/// Runs a PCL filter on the points that count.
template <typename Filter>
void filterIndices(Filter& filter, bool negative, Frame& frame) {
  filter.setInputCloud(frame.cloud);
  filter.setIndices(pcl::make_shared<pcl::Indices>(frame.indices));
  filter.setNegative(negative);
  filter.filter(frame.indices);
}

class PassThroughStage : public Stage {
 public:
  static constexpr const char* kName = "pass_through";
  static constexpr const char* kSummary = "keeps points between two values of x, y or z";
  static constexpr StageKind kKind = StageKind::Points;

  void declare(ParameterTable& table) override {
    table.word<std::string>("axis", axis_, {{"x", "x"}, {"y", "y"}, {"z", "z"}},
                            "coordinate that is limited, sensor frame");
    table.number("min_m", min_, Range::any(), "smallest value kept");
    table.number("max_m", max_, Range::any(), "largest value kept");
    table.flag("negative", negative_, "keep what is outside instead");
  }
  void configure(const RunSettings&) override {
    if (min_ > max_) throw ParameterError("min_m", min_, "<= max_m", "m");
  }
  void process(Frame& frame) override {
    pcl::PassThrough<pcl::PointXYZ> filter;
    filter.setFilterFieldName(axis_);
    filter.setFilterLimits(static_cast<float>(min_), static_cast<float>(max_));
    filterIndices(filter, negative_, frame);
  }

 private:
  std::string axis_ = "z";
  double min_ = 0.0;
  double max_ = 10.0;
  bool negative_ = false;
};

class CropBoxStage : public Stage {
 public:
  static constexpr const char* kName = "crop_box";
  static constexpr const char* kSummary = "keeps points inside a box";
  static constexpr StageKind kKind = StageKind::Points;

  void declare(ParameterTable& table) override {
    const char* axes[] = {"x", "y", "z"};
    for (int i = 0; i < 3; ++i) {
      const std::string axis = axes[i];
      table.number("min_" + axis + "_m", low_[i], Range::any(), "lower face of the box");
      table.number("max_" + axis + "_m", high_[i], Range::any(), "upper face of the box");
    }
    table.word("frame", world_, {{"sensor", false}, {"world", true}}, "frame of the box");
    table.flag("negative", negative_, "keep what is outside instead");
  }
  void configure(const RunSettings&) override {
    for (int i = 0; i < 3; ++i) {
      const std::string axis(1, "xyz"[i]);
      if (low_[i] > high_[i]) {
        throw ParameterError("min_" + axis + "_m", low_[i], "<= max_" + axis + "_m", "m");
      }
    }
  }
  void process(Frame& frame) override {
    pcl::CropBox<pcl::PointXYZ> filter;
    filter.setMin({toFloat(low_[0]), toFloat(low_[1]), toFloat(low_[2]), 1.0f});
    filter.setMax({toFloat(high_[0]), toFloat(high_[1]), toFloat(high_[2]), 1.0f});
    if (world_) {
      // CropBox moves the points by this before it compares them with the box.
      Eigen::Affine3f T = Eigen::Affine3f::Identity();
      T.matrix() = frame.T_world_sensor.matrix().cast<float>();
      filter.setTransform(T);
    }
    filterIndices(filter, negative_, frame);
  }

 private:
  static float toFloat(double value) { return static_cast<float>(value); }

  Vector3 low_{-100.0, -100.0, -100.0};
  Vector3 high_{100.0, 100.0, 100.0};
  bool world_ = false;
  bool negative_ = false;
};

}  // namespace

void detail::addCropFilters(StageTable& table) {
  table.add<PassThroughStage>();
  table.add<CropBoxStage>();
}

}  // namespace planar_mapping
