// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/stereo/disparity_image.h"
#include "planar_mapping/stereo/features/cloud_features.h"

namespace planar_mapping::detail {
namespace {

std::vector<float> wall(std::uint64_t seed, int count) {
  Random random(seed);
  std::vector<float> xyz;
  for (int i = 0; i < count; ++i) {
    xyz.push_back(static_cast<float>(random.uniform(-1.0, 1.0)));
    xyz.push_back(static_cast<float>(random.uniform(-0.5, 0.5)));
    xyz.push_back(2.05f);
  }
  return xyz;
}

PointsView viewOf(const std::vector<float>& xyz) {
  return {xyz.data(), xyz.size() / 3};
}

TEST(CloudFeatures, OneFeatureInEachCellAtTheMeanOfItsPoints) {
  CloudFeatureParams params;
  params.cell = 1.0;
  params.min_points = 2;
  CloudFeatureSampler sampler(params);
  const std::vector<float> xyz = {0.1f, 0.1f, 0.1f, 5.5f, 0.5f, 0.5f, 0.3f, 0.5f,
                                  0.7f, 5.7f, 0.9f, 0.5f, 9.0f, 9.0f, 9.0f};
  const auto features = sampler.sample(viewOf(xyz), nullptr, Pose::Identity());
  ASSERT_EQ(features.size(), 2u);
  EXPECT_TRUE(features[0].position.isApprox(Vector3(0.2, 0.3, 0.4), 1e-6));
  EXPECT_TRUE(features[1].position.isApprox(Vector3(5.6, 0.7, 0.5), 1e-6));
  EXPECT_NE(features[0].track, features[1].track);
  EXPECT_TRUE(std::isnan(features[0].column));
}

TEST(CloudFeatures, TheWorldCellIsTheIdentity) {
  const std::vector<float> xyz = wall(1, 4000);
  CloudFeatureSampler sampler;
  const auto first = sampler.sample(viewOf(xyz), nullptr, Pose::Identity());
  // The camera moves by three cells; the same points are seen from there.
  Pose moved = Pose::Identity();
  moved.translation() = Vector3(0.3, 0.0, 0.0);
  std::vector<float> seen = xyz;
  for (std::size_t i = 0; i < seen.size(); i += 3) seen[i] -= 0.3f;
  const auto second = sampler.sample(viewOf(seen), nullptr, moved);
  std::set<std::int64_t> known;
  for (const KeyFeature& feature : first) known.insert(feature.track);
  std::size_t again = 0;
  for (const KeyFeature& feature : second) {
    if (known.count(feature.track) == 0) continue;
    ++again;
    EXPECT_EQ(feature.sightings, 2);
  }
  EXPECT_GT(again, first.size() * 9 / 10);
}

TEST(CloudFeatures, WithoutAPoseEveryFeatureIsNew) {
  const std::vector<float> xyz = wall(2, 1000);
  CloudFeatureSampler sampler;
  std::set<std::int64_t> numbers;
  std::size_t count = 0;
  for (int frame = 0; frame < 3; ++frame) {
    for (const KeyFeature& feature : sampler.sample(viewOf(xyz), nullptr, std::nullopt)) {
      numbers.insert(feature.track);
      EXPECT_EQ(feature.sightings, 1);
      ++count;
    }
  }
  EXPECT_EQ(numbers.size(), count);
}

TEST(CloudFeatures, CellsAreForgottenAfterTheGivenTime) {
  const std::vector<float> here = wall(3, 1000);
  const std::vector<float> nothing;
  CloudFeatureParams params;
  params.remember_frames = 1;
  CloudFeatureSampler sampler(params);
  sampler.sample(viewOf(here), nullptr, Pose::Identity());
  sampler.sample(viewOf(nothing), nullptr, Pose::Identity());
  for (const KeyFeature& feature : sampler.sample(viewOf(here), nullptr, Pose::Identity()))
    EXPECT_EQ(feature.sightings, 2);
  sampler.sample(viewOf(nothing), nullptr, Pose::Identity());
  sampler.sample(viewOf(nothing), nullptr, Pose::Identity());
  for (const KeyFeature& feature : sampler.sample(viewOf(here), nullptr, Pose::Identity()))
    EXPECT_EQ(feature.sightings, 1);
}

TEST(CloudFeatures, TheFullestCellsComeFirst) {
  CloudFeatureParams params;
  params.cell = 1.0;
  params.min_points = 1;
  params.max_features = 2;
  CloudFeatureSampler sampler(params);
  const std::vector<float> xyz = {0.5f, 0.5f, 0.5f, 1.5f, 0.5f, 0.5f, 1.6f, 0.5f,
                                  0.5f, 2.5f, 0.5f, 0.5f, 2.6f, 0.5f, 0.5f};
  const auto features = sampler.sample(viewOf(xyz), nullptr, std::nullopt);
  ASSERT_EQ(features.size(), 2u);
  EXPECT_NEAR(features[0].position.x(), 1.55, 1e-6);
  EXPECT_NEAR(features[1].position.x(), 2.55, 1e-6);
}

TEST(CloudFeatures, OnlyFinitePointsOfTheIndicesCount) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  CloudFeatureParams params;
  params.min_points = 1;
  CloudFeatureSampler sampler(params);
  constexpr float kNan = test::kNanFloat;
  const std::vector<float> xyz = {kNan, 0.0f, 0.0f, 0.0f, kInf, 0.0f, 1e30f, 0.0f,
                                  0.0f, 1.0f, 1.0f, 1.0f, 4.0f, 4.0f, 4.0f};
  EXPECT_EQ(sampler.sample(viewOf(xyz), nullptr, Pose::Identity()).size(), 2u);
  const Indices indices = {0, 3};
  EXPECT_EQ(sampler.sample(viewOf(xyz), &indices, Pose::Identity()).size(), 1u);
  const Indices outside = {7};
  EXPECT_THROW(sampler.sample(viewOf(xyz), &outside, std::nullopt), InputError);
  EXPECT_TRUE(sampler.sample(PointsView(), nullptr, std::nullopt).empty());
}

TEST(CloudFeatures, RefusesParametersOutOfRange) {
  const auto refused = [](auto&& change) {
    CloudFeatureParams params;
    change(params);
    EXPECT_THROW(CloudFeatureSampler{params}, ParameterError);
  };
  refused([](auto& p) { p.cell = 0.0; });
  refused([](auto& p) { p.cell = std::nan(""); });
  refused([](auto& p) { p.min_points = 0; });
  refused([](auto& p) { p.max_features = 0; });
  refused([](auto& p) { p.remember_frames = -1; });
}

io::Calibration smallCalibration() {
  io::Calibration calibration;
  calibration.camera = {100.0, 50.0, 1.0, 0.5, 4, 2};
  calibration.cx_right = 3.0;  // infinity is at disparity -2
  calibration.baseline = 0.2;
  return calibration;
}

DisparityImage smallImage() {
  return {4, 2, {2.0f, 8.0f, test::kNanFloat, -2.0f, -3.0f, 0.0f, 18.0f, 1e30f}};
}

TEST(DisparityImage, PointsFollowFromTheEquation) {
  std::vector<float> xyz;
  triangulate(smallImage(), smallCalibration(), xyz);
  ASSERT_EQ(xyz.size(), 24u);
  // d = 2: Z = 100 * 0.2 / (2 + 2) = 5, X = (0 - 1) 5 / 100, Y = (0 - 0.5) 5 / 50.
  EXPECT_FLOAT_EQ(xyz[0], -0.05f);
  EXPECT_FLOAT_EQ(xyz[1], -0.05f);
  EXPECT_FLOAT_EQ(xyz[2], 5.0f);
  // d = 18 at (2, 1): Z = 1.
  EXPECT_FLOAT_EQ(xyz[18], 0.01f);
  EXPECT_FLOAT_EQ(xyz[19], 0.01f);
  EXPECT_FLOAT_EQ(xyz[20], 1.0f);
  // None, at infinity, behind the camera.
  for (const std::size_t i : {2u, 3u, 4u}) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_TRUE(std::isnan(xyz[3 * i + k])) << i;
  }
}

TEST(DisparityImage, DensityCountsWhatIsThere) {
  EXPECT_DOUBLE_EQ(smallImage().density(), 7.0 / 8.0);
  EXPECT_DOUBLE_EQ(DisparityImage().density(), 0.0);
}

TEST(DisparityImage, RefusesCalibrationsThatDoNotFit) {
  std::vector<float> xyz;
  io::Calibration calibration = smallCalibration();
  calibration.baseline.reset();
  EXPECT_THROW(triangulate(smallImage(), calibration, xyz), InputError);
  calibration = smallCalibration();
  calibration.camera.width = 5;
  EXPECT_THROW(triangulate(smallImage(), calibration, xyz), InputError);
  calibration = smallCalibration();
  calibration.unrectified.emplace();
  EXPECT_THROW(triangulate(smallImage(), calibration, xyz), InputError);
  DisparityImage damaged = smallImage();
  damaged.values.pop_back();
  EXPECT_THROW(triangulate(damaged, smallCalibration(), xyz), InputError);
}

}  // namespace
}  // namespace planar_mapping::detail
