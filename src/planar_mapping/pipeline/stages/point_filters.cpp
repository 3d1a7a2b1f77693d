// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Stages that drop or merge points: PCL's filters, and a limit of the depth error.
#include <pcl/common/common.h>
#include <pcl/filters/crop_box.h>
#include <pcl/filters/passthrough.h>
#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/noise_keys.h"
#include "planar_mapping/pipeline/stages/builtin.h"

namespace planar_mapping {
namespace {

class VoxelGridStage : public Stage {
 public:
  static constexpr const char* kName = "voxel_grid";
  static constexpr const char* kSummary = "replaces the points of each voxel by their centroid";
  static constexpr StageKind kKind = StageKind::Points;

  void declare(ParameterTable& table) override {
    table.number("leaf_size_m", leaf_size_, Range::positive(), "side of a voxel");
    table.integer("min_points", min_points_, Range::atLeast(1),
                  "voxels with fewer points are dropped");
  }
  void process(Frame& frame) override {
    const FrameCloud::Ptr reduced = pcl::make_shared<FrameCloud>();
    if (!frame.indices.empty()) {
      checkSize(frame);
      pcl::VoxelGrid<pcl::PointXYZ> filter;
      const auto leaf = static_cast<float>(leaf_size_);
      filter.setLeafSize(leaf, leaf, leaf);
      filter.setMinimumPointsNumberPerVoxel(static_cast<unsigned>(min_points_));
      filter.setInputCloud(frame.cloud);
      filter.setIndices(detail::sharedIndices(frame.indices));
      filter.filter(*reduced);
    }
    const std::size_t kept = reduced->size();
    // Ground points stay as they are: they still have to clear the space above them.
    for (const int i : frame.ground)
      reduced->points.push_back((*frame.cloud)[static_cast<std::size_t>(i)]);
    reduced->width = static_cast<std::uint32_t>(reduced->size());
    reduced->height = 1;
    reduced->is_dense = true;
    reduced->header = frame.cloud->header;
    frame.cloud = reduced;
    frame.camera.reset();  // no longer an image
    frame.indices.resize(kept);
    for (std::size_t i = 0; i < kept; ++i) frame.indices[i] = static_cast<int>(i);
    for (std::size_t i = 0; i < frame.ground.size(); ++i)
      frame.ground[i] = static_cast<int>(kept + i);
  }

 private:
  /// PCL numbers voxels by 32-bit integers and returns its input where those run over.
  void checkSize(const Frame& frame) const {
    Eigen::Vector4f low;
    Eigen::Vector4f high;
    pcl::getMinMax3D(*frame.cloud, frame.indices, low, high);
    const Vector3 size = high.head<3>().cast<double>() - low.head<3>().cast<double>();
    const Vector3 cells = size / leaf_size_ + Vector3::Ones() * 2.0;
    if (cells.prod() >= static_cast<double>(std::numeric_limits<std::int32_t>::max()))
      throw InputError(frame.source + ": voxel_grid: leaf_size_m = " + formatNumber(leaf_size_) +
                       " m is too small for a cloud of " + formatNumber(size.maxCoeff()) +
                       " m; use a larger one or crop the cloud before");
  }

  double leaf_size_ = 0.05;
  int min_points_ = 1;
};

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
      if (low_[i] > high_[i])
        throw ParameterError("min_" + axis + "_m", low_[i], "<= max_" + axis + "_m", "m");
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
  bool worksBeforeMotion() const override { return !world_; }

 private:
  static float toFloat(double value) { return static_cast<float>(value); }

  Vector3 low_{-100.0, -100.0, -100.0};
  Vector3 high_{100.0, 100.0, 100.0};
  bool world_ = false;
  bool negative_ = false;
};

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

/// A far point of a stereo camera says less about its place than a cell is large.
class DepthErrorLimitStage : public Stage {
 public:
  static constexpr const char* kName = "depth_error_limit";
  static constexpr const char* kSummary =
      "drops points whose depth error dz(z) is too large for the map [ours]";
  static constexpr StageKind kKind = StageKind::Points;

  void applyProfile(Profile profile) override {
    if (profile == Profile::Paper) noise_.setSource(detail::NoiseKeys::Source::None);
  }
  void declare(ParameterTable& table) override {
    table.number("max_error_m", max_error_, Range::positive(), "largest dz(z) that is kept");
    noise_.declareOptional(table, "without it, nothing is dropped");
  }
  void adapt(const CloudScale& scale) override { noise_.adapt(scale); }
  void limit(CloudScale& scale) const override {
    const std::optional<StereoNoise> noise = noise_.optionalNoise();
    if (!noise) return;
    const double farthest = farthestDepth(*noise);
    if (!std::isfinite(farthest)) return;
    scale.depth_limit = std::min(farthest, scale.depth_limit.value_or(farthest));
  }
  void process(Frame& frame) override {
    const std::optional<StereoNoise> noise = noise_.optionalNoise();
    if (!noise) return;
    const PointsView points = pointsOf(*frame.cloud);
    const float farthest = farthestDepth(*noise);
    const auto is_beyond = [&](int i) {
      return std::abs(points[static_cast<std::size_t>(i)][2]) > farthest;
    };
    frame.indices.erase(std::remove_if(frame.indices.begin(), frame.indices.end(), is_beyond),
                        frame.indices.end());
  }

 private:
  /// The largest depth whose error is within max_error_, so that points need no division. The
  /// error never falls with the depth, whatever is rounded, and neither do the bits of a float.
  float farthestDepth(const StereoNoise& noise) const {
    std::uint32_t within = 0;
    std::uint32_t beyond = 0x7F800000U;  // infinity
    const auto depthOf = [](std::uint32_t bits) {
      float depth = 0.0F;
      std::memcpy(&depth, &bits, sizeof(depth));
      return depth;
    };
    if (!(noise.depthError(depthOf(beyond)) > max_error_)) return depthOf(beyond);
    while (beyond - within > 1) {
      const std::uint32_t middle = within + (beyond - within) / 2;
      (noise.depthError(depthOf(middle)) > max_error_ ? beyond : within) = middle;
    }
    return depthOf(within);
  }

  double max_error_ = 0.1;
  detail::NoiseKeys noise_;
};

}  // namespace

void detail::addPointFilters(StageTable& table) {
  table.add<VoxelGridStage>();
  table.add<PassThroughStage>();
  table.add<CropBoxStage>();
  table.add<StatisticalOutlierRemovalStage>();
  table.add<RadiusOutlierRemovalStage>();
  table.add<DepthErrorLimitStage>();
}

}  // namespace planar_mapping
