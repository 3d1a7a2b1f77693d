// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/frame.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/core/ground/ground.h"

namespace planar_mapping {
namespace {

constexpr std::size_t kLargestSample = 100000;  // points that the scale is judged by
constexpr double kOutlierShare = 0.01;          // at either end of each axis
constexpr int kCellsAlongAxis = 64;             // of the grid that measures the surface

double quantile(std::vector<float>& values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

/// Square root of the area that one point stands for: the area is counted in coarse cells.
double spacingOf(const std::vector<Vector3>& sample, const Vector3& low, double side,
                 std::size_t points) {
  if (!(side > 0.0)) return 0.0;
  const double cell = side / kCellsAlongAxis;
  std::vector<std::uint8_t> occupied(
      static_cast<std::size_t>(kCellsAlongAxis) * kCellsAlongAxis * kCellsAlongAxis, 0);
  std::size_t cells = 0;
  for (const Vector3& p : sample) {
    std::size_t index = 0;
    bool inside = true;
    for (int axis = 0; axis < 3; ++axis) {
      const double c = (p[axis] - low[axis]) / cell;
      inside = inside && c >= 0.0 && c < kCellsAlongAxis;
      index = index * kCellsAlongAxis + (inside ? static_cast<std::size_t>(c) : 0);
    }
    if (inside && occupied[index] == 0) {
      occupied[index] = 1;
      ++cells;
    }
  }
  return cell * std::sqrt(static_cast<double>(cells) / static_cast<double>(points));
}

}  // namespace

PointsView viewOf(const FrameCloud& cloud) {
  static_assert(sizeof(pcl::PointXYZ) % sizeof(float) == 0, "points are read as rows of floats");
  PointsView view(reinterpret_cast<const float*>(cloud.points.data()), cloud.size(),
                  sizeof(pcl::PointXYZ) / sizeof(float));
  view.width = cloud.width;
  view.height = cloud.height;
  return view;
}

CloudScale scaleOf(const FrameCloud& cloud, const Indices& indices, const Pose& T_world_sensor) {
  CloudScale scale;
  scale.points = indices.size();
  scale.up = Vector3::UnitZ();
  if (indices.empty()) return scale;
  const std::size_t step = indices.size() / kLargestSample + 1;
  std::vector<Vector3> sample;
  std::vector<float> axis_values[3];
  std::vector<float> ranges;
  for (std::size_t i = 0; i < indices.size(); i += step) {
    const pcl::PointXYZ& p = cloud[static_cast<std::size_t>(indices[i])];
    sample.emplace_back(p.x, p.y, p.z);
    axis_values[0].push_back(p.x);
    axis_values[1].push_back(p.y);
    axis_values[2].push_back(p.z);
    ranges.push_back(static_cast<float>(sample.back().norm()));
  }
  Vector3 low;
  Vector3 size;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = quantile(axis_values[axis], kOutlierShare);
    size[axis] = quantile(axis_values[axis], 1.0 - kOutlierShare) - low[axis];
  }
  scale.extent = size.norm();
  scale.max_range = quantile(ranges, 1.0 - kOutlierShare);
  scale.spacing = spacingOf(sample, low, size.maxCoeff(), indices.size());
  scale.optical = isCameraView(viewOf(cloud), &indices);
  scale.up = verticalOf(viewOf(cloud), &indices, T_world_sensor);
  return scale;
}

}  // namespace planar_mapping
