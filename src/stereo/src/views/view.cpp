// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>

#include "cv_image.h"
#include "views/placed_views.h"

namespace planar_mapping {
namespace {

/// Depth between pixels: on one surface interpolated, else of the nearest surface around.
double depthAt(const std::vector<float>& depths, int width, int height, double column, double row) {
  constexpr float kSameSurface = 0.02f;  // of the depth
  const int left = static_cast<int>(column);
  const int top = static_cast<int>(row);
  if (left < 0 || top < 0 || left + 1 >= width || top + 1 >= height) return 0.0;
  const float* at = depths.data() + static_cast<std::size_t>(top) * width + left;
  const float around[] = {at[0], at[1], at[width], at[width + 1]};
  float nearest = std::numeric_limits<float>::infinity();
  float farthest = 0.0f;
  bool all = true;
  for (const float depth : around) {
    all = all && depth > 0.0f;
    if (depth > 0.0f) nearest = std::min(nearest, depth);
    farthest = std::max(farthest, depth);
  }
  if (farthest <= 0.0f) return 0.0;
  if (!all || farthest - nearest > kSameSurface * nearest) return nearest;
  const double a = column - left;
  const double b = row - top;
  return (1.0 - b) * ((1.0 - a) * around[0] + a * around[1]) +
         b * ((1.0 - a) * around[2] + a * around[3]);
}

}  // namespace

ViewMap::View::View(const io::Image& image, const PointsView& cloud, const PinholeCamera& pinhole,
                    const FeatureCamera& noise)
    : gray_(io::toGray(image)), camera_(pinhole) {
  cells = viewCellsOf(gray_.pixels.data(), cloud, pinhole, noise);
  depths_.resize(cloud.size);
  for (std::size_t i = 0; i < cloud.size; ++i) {
    const float depth = cloud[i][2];
    depths_[i] = std::isfinite(depth) && depth > 0.0f ? depth : 0.0f;
  }
}

void ViewMap::View::detect(const ViewMapParams& params) {
  if (detected_) return;
  detected_ = true;
  FeatureTrackerParams detection;
  detection.detector = FeatureDetector::Sift;
  detection.detection_threshold = 0.015;  // half the usual contrast: plain walls have some
  const detail::OpenCvThreads threads(params.threads);
  const detail::DetectedFeatures found =
      detail::detectFeatures(detail::matOf(gray_), detection, params.max_features);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const detail::Detection& place = found.places[i];
    const double depth = depthAt(depths_, camera_.width, camera_.height, place.column, place.row);
    if (!(depth > 0.0)) continue;
    sightings.push_back({place.column, place.row, 1.0 / depth});
    descriptors.add(found.descriptors, i);
  }
  gray_ = io::Image();
  depths_ = {};
}

}  // namespace planar_mapping
