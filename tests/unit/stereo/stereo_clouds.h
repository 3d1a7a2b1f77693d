// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "numbers.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/ground/ground.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/planes/multi_plane.h"
#include "planar_mapping/stereo/matching/stereo_matcher.h"
#include "real_data.h"

// Clouds of real pairs, their planes and ground: our own matching, default parameters.
namespace planar_mapping::test {

/// A cloud with the noise of its camera.
struct Cloud {
  std::vector<float> xyz;
  int width = 0;
  int height = 0;
  std::optional<StereoNoise> noise;
  Indices valid;
  std::size_t measured = 0;  ///< points of the whole frame

  PointsView view() const {
    return PointsView(xyz.data(), static_cast<std::uint32_t>(width),
                      static_cast<std::uint32_t>(height), 3);
  }
  void list() {
    for (std::size_t i = 0; i < view().size; ++i) {
      if (view().isMeasured(i)) valid.push_back(static_cast<int>(i));
    }
    measured = valid.size();
  }
};

inline Cloud cloudOf(const DisparityImage& disparity, const io::Calibration& calibration) {
  Cloud cloud;
  triangulate(disparity, calibration, cloud.xyz);
  cloud.width = disparity.width;
  cloud.height = disparity.height;
  cloud.noise = StereoNoise{*calibration.baseline, calibration.camera.fx, 0.5};
  cloud.list();
  return cloud;
}

/// Cloud of pair \p number of a folder of the data.
/// \param draw  if not 0, of all but a hundredth of the pixels, another one for each draw: what a
///              search finds in foliage hangs on single pixels
inline Cloud matched(const std::string& set, const std::string& number, int draw = 0) {
  const io::Calibration calibration = io::readCalibration(realData(set) + "/calib.yaml");
  const auto read = [&](const char* side) {
    return io::readImage(realData(set) + "/" + side + "/" + number + ".png");
  };
  DisparityImage disparity = StereoMatcher().match(read("left"), read("right"), calibration);
  Random random(static_cast<std::uint64_t>(draw));
  for (float& value : disparity.values) {
    if (draw != 0 && random.below(100) == 0) value = std::numeric_limits<float>::quiet_NaN();
  }
  return cloudOf(disparity, calibration);
}

/// The defaults of the library and the values of the ready configurations.
struct Setting {
  const char* name;
  double max_depth_error;  ///< of the points that count, metres
  double distance_threshold;
  double noise_factor;
};
inline constexpr Setting kLibrary = {"library", 1e9, 0.05, 3.0};
inline constexpr Setting kSettings[] = {
    kLibrary, {"stereo_indoor.yaml", 0.2, 0.05, 2.0}, {"stereo_outdoor.yaml", 0.4, 0.1, 2.0}};

inline PlaneSet planesOf(const Cloud& cloud, const Indices* indices = nullptr,
                         const Setting& setting = kLibrary) {
  MultiPlaneParams params;
  params.noise = cloud.noise;
  params.min_inliers = std::max(50, static_cast<int>(cloud.measured / 300));
  params.distance_threshold = setting.distance_threshold;
  params.noise_factor = setting.noise_factor;
  return findPlanes(cloud.view(), indices, params);
}

/// The cloud with those points alone valid that are near enough to count.
inline Cloud limited(const Cloud& cloud, const Setting& setting) {
  Cloud near = cloud;
  near.valid.clear();
  for (const int i : cloud.valid) {
    const double z = cloud.view().point(static_cast<std::size_t>(i)).z();
    if (cloud.noise->depthError(z) <= setting.max_depth_error) near.valid.push_back(i);
  }
  return near;
}

inline Ground groundOf(const Cloud& cloud) {
  GroundParams params;
  params.camera_height = 0.0;
  params.noise = cloud.noise;
  return findGround(cloud.view(), &cloud.valid, params);
}

/// The valid points that are not ground.
inline Indices above(const Cloud& cloud, const Ground& ground) {
  Indices left;
  for (std::size_t i = 0; i < cloud.valid.size(); ++i) {
    if (ground.is_ground[i] == 0) left.push_back(cloud.valid[i]);
  }
  return left;
}

}  // namespace planar_mapping::test
