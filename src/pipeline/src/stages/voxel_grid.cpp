// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/common/common.h>
#include <pcl/filters/voxel_grid.h>

#include <limits>

#include "builtin.h"
#include "planar_mapping/core/base/error.h"

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
    for (const int i : frame.ground) {
      reduced->points.push_back((*frame.cloud)[static_cast<std::size_t>(i)]);
    }
    reduced->width = static_cast<std::uint32_t>(reduced->size());
    reduced->height = 1;
    reduced->is_dense = true;
    reduced->header = frame.cloud->header;
    frame.cloud = reduced;
    frame.camera.reset();  // no longer an image
    frame.indices.resize(kept);
    for (std::size_t i = 0; i < kept; ++i) frame.indices[i] = static_cast<int>(i);
    for (std::size_t i = 0; i < frame.ground.size(); ++i) {
      frame.ground[i] = static_cast<int>(kept + i);
    }
  }

 private:
  /// PCL numbers voxels by 32-bit integers and returns its input where those run over.
  void checkSize(const Frame& frame) const {
    Eigen::Vector4f low;
    Eigen::Vector4f high;
    pcl::getMinMax3D(*frame.cloud, frame.indices, low, high);
    const Vector3 size = high.head<3>().cast<double>() - low.head<3>().cast<double>();
    const Vector3 cells = size / leaf_size_ + Vector3::Ones() * 2.0;
    if (cells.prod() >= static_cast<double>(std::numeric_limits<std::int32_t>::max())) {
      throw InputError(frame.source + ": voxel_grid: leaf_size_m = " + formatNumber(leaf_size_) +
                       " m is too small for a cloud of " + formatNumber(size.maxCoeff()) +
                       " m; use a larger one or crop the cloud before");
    }
  }

  double leaf_size_ = 0.05;
  int min_points_ = 1;
};

}  // namespace

void detail::addVoxelGrid(StageTable& table) {
  table.add<VoxelGridStage>();
}

}  // namespace planar_mapping
