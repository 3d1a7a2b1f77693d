// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "depth_scene.h"
#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping {
namespace {

using namespace test;

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr double kFocal = 256.0;
constexpr double kBaseline = 0.12;

MultiPlaneParams stereo(int min_inliers = 500) {
  MultiPlaneParams params;
  params.method = PlaneSearchMethod::Disparity;
  params.noise = StereoNoise{kBaseline, kFocal, 0.5};
  params.min_inliers = min_inliers;
  return params;
}

/// \param noise standard deviation of the disparity, pixels
void render(DepthScene& scene, double noise, std::uint64_t seed = 1) {
  scene.render(noise / (kBaseline * kFocal), 0.02, seed);
}

TEST(DisparityPlanes, FindsNoiseFreePlanesExactly) {
  DepthScene scene = cornerOfARoom();
  render(scene, 0.0);
  const PlaneSet set = findPlanes(scene.view(), nullptr, stereo());
  EXPECT_EQ(set.diagnostics.method, PlaneSearchMethod::Disparity);
  ASSERT_EQ(set.planes.size(), 3U);
  for (int surface = 0; surface < 3; ++surface) {
    std::size_t k = 0;
    EXPECT_GT(recall(scene, set, surface, &k), 0.97);
    EXPECT_LT(angleBetween(set.planes[k].plane, scene.plane(surface)), 0.3 * test::kDegree);
    EXPECT_NEAR(set.planes[k].plane.offset, scene.plane(surface).offset, 0.01);
    EXPECT_GT(set.planes[k].plane.offset, 0.0);  // towards the sensor
  }
}

TEST(DisparityPlanes, FindsPlanesInStereoNoise) {
  // At the far wall half a pixel is 0.2 m; windows of 24 pixels are 0.35 m wide there.
  for (const double noise : {0.1, 0.25, 0.5}) {
    DepthScene scene = cornerOfARoom();
    render(scene, noise);
    const PlaneSet set = findPlanes(scene.view(), nullptr, stereo());
    ASSERT_EQ(set.planes.size(), 3U) << noise;
    // Where walls meet, half a pixel of noise mixes ten pixels on either side.
    const double min_recall = noise < 0.4 ? 0.93 : 0.85;
    const double max_angle = (noise < 0.4 ? 0.8 : 2.0) * test::kDegree;
    for (int surface = 0; surface < 3; ++surface) {
      std::size_t k = 0;
      EXPECT_GT(recall(scene, set, surface, &k), min_recall) << noise << " " << surface;
      EXPECT_LT(angleBetween(set.planes[k].plane, scene.plane(surface)), max_angle)
          << noise << " " << surface;
    }
  }
}

TEST(DisparityPlanes, AutomaticTakesItForImagesWithNoiseGiven) {
  DepthScene scene = cornerOfARoom();
  render(scene, 0.25);
  MultiPlaneParams params = stereo();
  params.method = PlaneSearchMethod::Automatic;
  expectSameBytes(findPlanes(scene.view(), nullptr, params),
                  findPlanes(scene.view(), nullptr, stereo()));
  EXPECT_EQ(findPlanes(scene.view(), nullptr, params, {0.1, 0.0, 0.0}).diagnostics.method,
            PlaneSearchMethod::Organized);
  params.noise.reset();
  EXPECT_EQ(findPlanes(scene.view(), nullptr, params).diagnostics.method,
            PlaneSearchMethod::Organized);
}

TEST(DisparityPlanes, MomentsDescribeThePlane) {
  // The map refits planes from moments: noise along oblique rays must not turn them.
  DepthScene scene = cornerOfARoom();
  render(scene, 0.25);
  const PlaneSet set = findPlanes(scene.view(), nullptr, stereo());
  ASSERT_EQ(set.planes.size(), 3U);
  for (const PlaneSegment& segment : set.planes) {
    const PlaneMoments::Fit fit = segment.moments.fit();
    EXPECT_LT(angleBetween(fit.plane, segment.plane), 0.05 * test::kDegree);
    EXPECT_NEAR(fit.rms, segment.rms, 0.05 * segment.rms);
    EXPECT_EQ(segment.moments.weight(), static_cast<double>(segment.inliers.size()));
    Vector3 mean = Vector3::Zero();
    for (const int i : segment.inliers) mean += scene.view().point(static_cast<std::size_t>(i));
    mean /= static_cast<double>(segment.inliers.size());
    EXPECT_LT((mean - segment.moments.mean()).norm(), 0.05);
  }
}

TEST(DisparityPlanes, CovarianceCoversTheError) {
  int beyond = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    DepthScene scene = cornerOfARoom();
    render(scene, 0.25, seed);
    const PlaneSet set = findPlanes(scene.view(), nullptr, stereo());
    for (int surface = 0; surface < 3; ++surface) {
      std::size_t k = 0;
      ASSERT_GT(recall(scene, set, surface, &k), 0.9);
      const Matrix4& covariance = set.planes[k].covariance;
      const double sigma = std::sqrt(covariance(0, 0) + covariance(1, 1) + covariance(2, 2));
      EXPECT_GT(sigma, 0.0);
      EXPECT_LT(sigma, 5.0 * test::kDegree);
      if (angleBetween(set.planes[k].plane, scene.plane(surface)) > 3.0 * sigma) ++beyond;
    }
  }
  EXPECT_LE(beyond, 3);
}

TEST(DisparityPlanes, ParallelPlanesBesideEachOtherStayApart) {
  DepthScene scene(kWidth, kHeight, kFocal);
  scene.addRectangle({-1.0, 0.0, 2.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0});
  scene.addRectangle({1.25, 0.0, 2.5}, {1.25, 0.0, 0.0}, {0.0, 1.5, 0.0});
  render(scene, 0.25);
  const PlaneSet set = findPlanes(scene.view(), nullptr, stereo());
  ASSERT_EQ(set.planes.size(), 2U);
  for (int surface = 0; surface < 2; ++surface) {
    std::size_t k = 0;
    EXPECT_GT(recall(scene, set, surface, &k), 0.95);
    EXPECT_LT(angleBetween(set.planes[k].plane, scene.plane(surface)), 1.0 * test::kDegree);
  }
}

TEST(DisparityPlanes, OnePlaneInTwoPatchesIsOnePlane) {
  DepthScene scene(kWidth, kHeight, kFocal);
  scene.addRectangle({-0.8, 0.0, 2.0}, {0.35, 0.0, 0.0}, {0.0, 0.6, 0.0});
  scene.addRectangle({0.8, 0.0, 2.0}, {0.35, 0.0, 0.0}, {0.0, 0.6, 0.0});
  render(scene, 0.1);
  const PlaneSet set = findPlanes(scene.view(), nullptr, stereo());
  ASSERT_EQ(set.planes.size(), 1U);
  EXPECT_EQ(set.planes[0].number_of_patches, 2);
  EXPECT_EQ(set.planes[0].patches.size(), set.planes[0].inliers.size());
}

TEST(DisparityPlanes, ABallIsNoPlane) {
  DepthScene scene(kWidth, kHeight, kFocal);
  scene.addBall({0.0, 0.0, 1.6}, 0.7);
  render(scene, 0.1);
  const PlaneSet set = findPlanes(scene.view(), nullptr, stereo());
  std::size_t most = 0;
  for (const PlaneSegment& segment : set.planes) most = std::max(most, segment.inliers.size());
  EXPECT_LT(most, scene.pixelsOf(0) / 5);
}

TEST(DisparityPlanes, ThreadsAndOrderOfIndicesChangeNothing) {
  DepthScene scene = cornerOfARoom();
  render(scene, 0.25);
  const PlaneSet one = findPlanes(scene.view(), nullptr, stereo());
  MultiPlaneParams params = stereo();
  params.threads = 3;
  expectSameBytes(one, findPlanes(scene.view(), nullptr, params));
  Indices backwards;
  for (std::size_t i = scene.truth.size(); i > 0; --i) backwards.push_back(static_cast<int>(i - 1));
  expectSameBytes(one, findPlanes(scene.view(), &backwards, stereo()));
}

TEST(DisparityPlanes, OnlyIndexedPointsCount) {
  DepthScene scene = cornerOfARoom();
  render(scene, 0.1);
  Indices right;
  for (std::size_t i = 0; i < scene.truth.size(); ++i) {
    if (i % kWidth >= 160) right.push_back(static_cast<int>(i));
  }
  const PlaneSet set = findPlanes(scene.view(), &right, stereo());
  ASSERT_FALSE(set.planes.empty());
  for (const PlaneSegment& segment : set.planes) {
    EXPECT_TRUE(std::is_sorted(segment.inliers.begin(), segment.inliers.end()));
    for (const int i : segment.inliers) EXPECT_GE(i % kWidth, 160);
  }
}

TEST(DisparityPlanes, ImageSizesThatAreNoMultipleOfTiles) {
  for (const int width : {33, 37, 161}) {
    DepthScene scene(width, 45, 60.0);
    scene.addPlane({0.0, 0.0, 2.0}, {0.3, 0.1, 1.0});
    scene.render(0.0, 0.0, 1);
    MultiPlaneParams params = stereo(100);
    params.noise->focal_length = 60.0;
    const PlaneSet set = findPlanes(scene.view(), nullptr, params);
    ASSERT_EQ(set.planes.size(), 1U) << width;
    EXPECT_EQ(set.planes[0].inliers.size(), scene.truth.size()) << width;
  }
}

TEST(DisparityPlanes, HostileInputGivesNoPlaneAndNoCrash) {
  std::vector<float> xyz(3 * 64 * 48, test::kNanFloat);
  const PointsView view(xyz.data(), 64, 48, 3);
  EXPECT_TRUE(findPlanes(view, nullptr, stereo()).planes.empty());
  xyz[0] = xyz[1] = 0.0F;
  xyz[2] = 1.0F;  // one point
  EXPECT_TRUE(findPlanes(view, nullptr, stereo()).planes.empty());
  // One point often, points behind the camera, none.
  for (const float value : {1.0F, -2.0F, std::numeric_limits<float>::infinity(), 0.0F, 1e-38F}) {
    std::fill(xyz.begin(), xyz.end(), value);
    EXPECT_TRUE(findPlanes(view, nullptr, stereo()).planes.empty()) << value;
  }
  Random random(1);
  for (float& value : xyz) value = static_cast<float>(1e9 * random.normal());
  findPlanes(view, nullptr, stereo());
  for (float& value : xyz) value = static_cast<float>(1e30 * random.normal());
  findPlanes(view, nullptr, stereo());
  EXPECT_TRUE(findPlanes(PointsView(), nullptr, stereo()).planes.empty());
  const Indices none;
  EXPECT_TRUE(findPlanes(view, &none, stereo()).planes.empty());
}

TEST(DisparityPlanes, NeedsTheNoiseAndTheSensorAtTheOrigin) {
  DepthScene scene = cornerOfARoom();
  render(scene, 0.0);
  MultiPlaneParams params = stereo();
  EXPECT_THROW(findPlanes(scene.view(), nullptr, params, {0.0, 0.0, 1.0}), InputError);
  params.noise.reset();
  EXPECT_THROW(findPlanes(scene.view(), nullptr, params), ParameterError);
  params.noise = StereoNoise{kBaseline, kFocal, 0.0};  // no noise is fine
  EXPECT_EQ(findPlanes(scene.view(), nullptr, params).planes.size(), 3U);
}

}  // namespace
}  // namespace planar_mapping
