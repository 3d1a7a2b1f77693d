// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/place_finder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "planar_mapping/atlas/keyframe_maker.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "tests/unit/localization/textured_wall.h"

namespace planar_mapping {
namespace {

using textured_wall::camera;
using textured_wall::kHeight;
using textured_wall::kWidth;
using textured_wall::placed;
using textured_wall::View;
using textured_wall::viewFrom;

Keyframe keyframe(const Pose& T_world_camera, std::uint64_t seed, std::int64_t id) {
  const View view = viewFrom(T_world_camera, seed);
  Keyframe key = makeKeyframe(view.gray, view.cloud(), camera());
  key.id = id;
  key.submap = id;
  return key;
}

std::size_t bytesOf(const Keyframe& key) {
  return key.descriptors.size() + key.sightings.size() * sizeof(FeatureSighting) +
         2 * key.inverse_depths.size() + key.thumbnail.size();
}

TEST(KeyframeMaker, KeepsThirtyKilobytesAtMost) {
  View view = viewFrom(Pose::Identity(), 1);
  Random random(3);
  for (std::uint8_t& pixel : view.gray.pixels)
    pixel = static_cast<std::uint8_t>((pixel + random.below(128)) / 2 + random.below(64));
  const Keyframe key = makeKeyframe(view.gray, view.cloud(), camera());
  std::printf("%zu features, %zu bytes\n", key.sightings.size(), bytesOf(key));
  EXPECT_LE(bytesOf(key), 30000u);
  EXPECT_GE(key.sightings.size(), 100u);
  EXPECT_LE(key.sightings.size(), 200u);
  EXPECT_EQ(key.descriptors.size(), key.sightings.size() * key.descriptor_bytes);
}

TEST(KeyframeMaker, KeepsDepthsOfCellsAndFeatures) {
  const Keyframe key = keyframe(Pose::Identity(), 1, 0);
  ASSERT_EQ(key.cells_across, 80);
  ASSERT_EQ(key.inverse_depths.size(), 80u * 60u);
  EXPECT_EQ(key.inverse_depths[0], 2048);                  // 2 m
  EXPECT_NEAR(key.inverse_depths[79], 4096.0 / 3.0, 1.0);  // 3 m
  for (const FeatureSighting& sighting : key.sightings) {
    const double depth = 1.0 / sighting.inverse_depth;
    EXPECT_LT(std::min(std::abs(depth - 2.0), std::abs(depth - 3.0)), 1e-3);
  }
  // Spread: each quarter of the image has some.
  int quarters[4] = {0, 0, 0, 0};
  for (const FeatureSighting& sighting : key.sightings)
    ++quarters[(sighting.column > 320 ? 1 : 0) + (sighting.row > 240 ? 2 : 0)];
  for (const int count : quarters) EXPECT_GE(count, 20);
}

TEST(KeyframeMaker, RefusesOtherSizesAndColours) {
  View view = viewFrom(Pose::Identity(), 1);
  EXPECT_THROW(makeKeyframe(view.gray, PointsView(view.xyz.data(), 320, 480, 3), camera()),
               InputError);
  view.gray.channels = 3;
  EXPECT_THROW(makeKeyframe(view.gray, view.cloud(), camera()), InputError);
}

TEST(KeyframeMaker, AnImageWithoutTextureOrDepthHasNoFeatures) {
  View view = viewFrom(Pose::Identity(), 1);
  const std::vector<float> xyz(view.xyz.size(), std::nanf(""));
  const PointsView nothing(xyz.data(), kWidth, kHeight, 3);
  EXPECT_TRUE(makeKeyframe(view.gray, nothing, camera()).sightings.empty());
  std::fill(view.gray.pixels.begin(), view.gray.pixels.end(), std::uint8_t{7});
  const Keyframe dark = makeKeyframe(view.gray, view.cloud(), camera());
  EXPECT_TRUE(dark.sightings.empty());
  EXPECT_FALSE(PlaceFinder::verify(dark, dark).has_value());
}

TEST(PlaceFinder, FindsAPlaceAgainAndMeasuresTheMotion) {
  const Pose T_world_b = placed({0.3, -0.1, 0.2}, {0.05, -0.12, 0.1});
  Keyframe a = keyframe(Pose::Identity(), 1, 0);
  Keyframe b = keyframe(T_world_b, 1, 9);
  a.T_submap_keyframe = placed({1.0, 2.0, 3.0}, {0.3, 0.2, 0.1});
  b.T_submap_keyframe = placed({-1.0, 0.5, 0.0}, {0.0, 0.7, 0.1});
  PlaceFinder finder;
  finder.add(a);
  for (std::int64_t id = 1; id < 9; ++id)
    finder.add(keyframe(Pose::Identity(), static_cast<std::uint64_t>(10 + id), id));
  const auto ids = finder.candidates(b, 3);
  ASSERT_FALSE(ids.empty());
  EXPECT_EQ(ids.front(), 0);

  const std::optional<Link> link = PlaceFinder::verify(a, b);
  ASSERT_TRUE(link.has_value());
  EXPECT_EQ(link->from_keyframe, 0);
  EXPECT_EQ(link->to_submap, 9);
  EXPECT_GT(link->evidence.agreement, 0.8);
  EXPECT_LT(link->evidence.seen_through, 0.1);
  const Pose expected = b.T_submap_keyframe * T_world_b.inverse() * a.T_submap_keyframe.inverse();
  const Pose off = link->T_to_from * expected.inverse();
  const Pose at_b = b.T_submap_keyframe.inverse() * off * b.T_submap_keyframe;
  EXPECT_LT(at_b.translation().norm(), 0.03);
  const Vector6 error = motionDifference(expected, link->T_to_from);
  EXPECT_LT(error.dot(link->covariance.inverse() * error), 22.46);
}

TEST(PlaceFinder, OtherPlacesGiveNoLink) {
  const Keyframe a = keyframe(Pose::Identity(), 1, 0);
  for (std::uint64_t seed = 2; seed < 8; ++seed) {
    const Keyframe b = keyframe(Pose::Identity(), seed, 1);
    EXPECT_FALSE(PlaceFinder::verify(a, b).has_value()) << seed;
  }
}

TEST(PlaceFinder, WhatLiesWhereTheOtherSawThroughIsNoLink) {
  const Keyframe a = keyframe(Pose::Identity(), 1, 0);
  Keyframe b = a;
  b.submap = b.id = 1;
  ASSERT_TRUE(PlaceFinder::verify(a, b).has_value());
  // The same image, but of most cells it measured twice the depth.
  for (std::size_t i = 0; i < b.inverse_depths.size() * 3 / 4; ++i) b.inverse_depths[i] /= 2;
  EXPECT_FALSE(PlaceFinder::verify(a, b).has_value());
}

TEST(PlaceFinder, LeavesOutTheOwnSubmapAndWhatIsExcluded) {
  const Keyframe a = keyframe(Pose::Identity(), 1, 0);
  PlaceFinder finder;
  finder.add(a);
  Keyframe other = a;
  other.id = 5;
  other.submap = 4;
  EXPECT_EQ(finder.size(), 1u);
  EXPECT_EQ(finder.candidates(other, 5), std::vector<std::int64_t>{0});
  EXPECT_TRUE(finder.candidates(other, 5, {0}).empty());
  EXPECT_TRUE(finder.candidates(other, 0).empty());
  other.submap = 0;
  EXPECT_TRUE(finder.candidates(other, 5).empty());
}

TEST(PlaceFinder, RefusesDescriptorsOfAnotherSize) {
  Keyframe key = keyframe(Pose::Identity(), 1, 0);
  key.descriptors.pop_back();
  PlaceFinder finder;
  EXPECT_THROW(finder.add(key), InputError);
}

}  // namespace
}  // namespace planar_mapping
