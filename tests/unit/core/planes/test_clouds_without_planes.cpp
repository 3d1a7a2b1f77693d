// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Noise, foliage and crumpled cloth: what is found there is a phantom.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping {
namespace {

constexpr std::uint32_t kCloudWidth = 320;
constexpr std::uint32_t kCloudHeight = 240;
constexpr double kCloudFocal = 260.0;

double between(Random& random, double low, double high) {
  return low + (high - low) * random.uniform();
}

/// A cloud of which some searches see the image, others only the points.
struct Cloud {
  std::vector<float> xyz;

  void add(double column, double row, double depth) {
    xyz.push_back(static_cast<float>((column - 0.5 * kCloudWidth) / kCloudFocal * depth));
    xyz.push_back(static_cast<float>((row - 0.5 * kCloudHeight) / kCloudFocal * depth));
    xyz.push_back(static_cast<float>(depth));
  }
  /// Every 80th point.
  PointsView image() const {
    PointsView view(xyz.data(), kCloudWidth);
    view.stride = kCloudHeight;
    return view;
  }
  PointsView points() const { return {xyz.data(), xyz.size() / 3}; }
};

Cloud cloudOf(const std::function<double(double, double)>& depthAt) {
  Cloud cloud;
  for (std::uint32_t row = 0; row < kCloudHeight; ++row) {
    for (std::uint32_t column = 0; column < kCloudWidth; ++column)
      cloud.add(column, row, depthAt(column, row));
  }
  return cloud;
}

/// Each depth is drawn by itself.
Cloud noise(Random& random) {
  return cloudOf([&](double, double) { return between(random, 1.0, 4.0); });
}

/// 4,000 leaves of 2 to 4 cm, turned at random, in a bush of 1.5 m depth.
Cloud foliage(Random& random) {
  std::vector<double> depth(kCloudWidth * kCloudHeight, 0.0);
  for (int leaf = 0; leaf < 4000; ++leaf) {
    const double z = between(random, 1.5, 3.0);
    const double radius = between(random, 0.01, 0.02) * kCloudFocal / z;
    const double column = between(random, 0.0, kCloudWidth);
    const double row = between(random, 0.0, kCloudHeight);
    const double slope_x = between(random, -1.5, 1.5);
    const double slope_y = between(random, -1.5, 1.5);
    for (double y = std::ceil(row - radius); y <= row + radius; ++y) {
      for (double x = std::ceil(column - radius); x <= column + radius; ++x) {
        if (std::hypot(x - column, y - row) > radius || !(x >= 0 && y >= 0) || x >= kCloudWidth ||
            y >= kCloudHeight) {
          continue;
        }
        double& at = depth[static_cast<std::size_t>(y) * kCloudWidth + static_cast<std::size_t>(x)];
        const double here = z + (slope_x * (x - column) + slope_y * (y - row)) * z / kCloudFocal;
        if (at == 0.0 || here < at) at = here;
      }
    }
  }
  return cloudOf([&](double column, double row) {
    const double z =
        depth[static_cast<std::size_t>(row) * kCloudWidth + static_cast<std::size_t>(column)];
    return z > 0.0 ? z + 0.002 * random.normal() : NAN;
  });
}

/// Folds of 10 to 25 cm in all directions, 4 to 8 cm high.
Cloud cloth(Random& random) {
  struct Fold {
    double x, y, phase, height;
  };
  std::vector<Fold> folds;
  for (int i = 0; i < 12; ++i) {
    const double wave = 2.0 * M_PI / between(random, 0.1, 0.25);
    const double angle = between(random, 0.0, 2.0 * M_PI);
    folds.push_back({wave * std::cos(angle), wave * std::sin(angle),
                     between(random, 0.0, 2.0 * M_PI), between(random, 0.04, 0.08)});
  }
  return cloudOf([&](double column, double row) {
    const double x = (column - 0.5 * kCloudWidth) / kCloudFocal * 1.5;
    const double y = (row - 0.5 * kCloudHeight) / kCloudFocal * 1.5;
    double z = 1.5 + 0.001 * random.normal();
    for (const Fold& f : folds) z += f.height * std::sin(f.x * x + f.y * y + f.phase);
    return z;
  });
}

double onPlanes(const PointsView& points, const MultiPlaneParams& params) {
  std::size_t on = 0;
  for (const PlaneSegment& plane : findPlanes(points, nullptr, params).planes)
    on += plane.inliers.size();
  return static_cast<double>(on) / static_cast<double>(points.size);
}

/// At most this fraction of the points of nine such clouds is on planes.
template <typename View>
void expectAtMost(double most, Cloud (*make)(Random&), const MultiPlaneParams& params, View view) {
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u, 9u}) {
    Random random(seed);
    const Cloud cloud = make(random);
    EXPECT_LE(onPlanes((cloud.*view)(), params), most) << "seed " << seed;
  }
}

MultiPlaneParams ofStereo() {
  MultiPlaneParams params;
  params.noise = StereoNoise{0.12, kCloudFocal, 0.5};
  return params;
}

TEST(CloudsWithoutPlanes, NoiseHasNone) {
  expectAtMost(0.0, noise, {}, &Cloud::image);
  expectAtMost(0.0, noise, ofStereo(), &Cloud::image);
  expectAtMost(0.03, noise, {}, &Cloud::points);  // a face of the frustum, seed 4
}

TEST(CloudsWithoutPlanes, FoliageHasNextToNone) {
  expectAtMost(0.03, foliage, {}, &Cloud::image);
  expectAtMost(0.03, foliage, ofStereo(), &Cloud::image);
  expectAtMost(0.03, foliage, {}, &Cloud::points);
}

/// As a cloud that is no image at most 2 %, but of seed 2: a wide fold is flat there.
TEST(CloudsWithoutPlanes, CrumpledClothHasNextToNone) {
  expectAtMost(0.05, cloth, {}, &Cloud::image);
  expectAtMost(0.05, cloth, ofStereo(), &Cloud::image);
  expectAtMost(0.09, cloth, {}, &Cloud::points);
}

}  // namespace
}  // namespace planar_mapping
