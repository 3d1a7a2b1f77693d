// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Poses that views confirm, refuse or cannot tell from others.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/localization/views/view_map.h"
#include "stereo_images.h"

namespace planar_mapping {
namespace {

constexpr double kWall = 2.0;  ///< depth of the wall, metres

PinholeCamera camera() {
  return {250.0, 250.0, 159.5, 119.5, 320, 240};
}

struct Shot {
  io::Image image;
  std::vector<float> xyz;

  PointsView cloud() const { return {xyz.data(), 320u, 240u, 3}; }
};

/// A wall across the view, seen from x, y before it and turned by \p yaw, radians.
Shot shoot(const Pose& T_world_camera, double period, std::uint64_t seed) {
  const PinholeCamera pinhole = camera();
  Shot shot;
  shot.image = {320, 240, 1, {}};
  for (int row = 0; row < 240; ++row) {
    for (int column = 0; column < 320; ++column) {
      double tone = 0.0;
      double depth = 0.0;
      for (const double offset : {-0.25, 0.25}) {  // four rays a pixel
        for (const double other : {-0.25, 0.25}) {
          const Vector3 ray = T_world_camera.linear() * pinhole.rayOf(column + offset, row + other);
          depth = (kWall - T_world_camera.translation().z()) / ray.z();
          const Vector3 hit = T_world_camera.translation() + depth * ray;
          tone += 0.25 * test::wallTone(hit.x(), hit.y(), period, seed);
        }
      }
      shot.image.pixels.push_back(static_cast<std::uint8_t>(std::lround(tone)));
      const Vector3 point = depth * pinhole.rayOf(column, row);
      for (int k = 0; k < 3; ++k) shot.xyz.push_back(static_cast<float>(point[k]));
    }
  }
  return shot;
}

Pose poseAt(double x, double yaw = 0.0) {
  Pose pose = Pose::Identity();
  pose.translation() = Vector3(x, 0.0, 0.0);
  pose.linear() = Eigen::AngleAxisd(yaw, Vector3::UnitY()).toRotationMatrix();
  return pose;
}

ViewMapParams params() {
  ViewMapParams result;
  result.camera = {250.0, 250.0, 159.5, 119.5, 0.5, 0.003, 0.002};
  return result;
}

ViewMap::ViewPtr see(const ViewMap& map, const Shot& shot) {
  return map.see(shot.image, shot.cloud(), camera());
}

TEST(ViewMap, FindsAViewFarFromWhereItIsExpected) {
  ViewMap map(params());
  map.insert(see(map, shoot(poseAt(0.0), 0.0, 1)), poseAt(0.0));
  const Pose truth = poseAt(0.8, 0.44);
  const ViewMap::Location found =
      map.locate(see(map, shoot(truth, 0.0, 1)), poseAt(0.0), {}, ViewGuess::Motion);
  ASSERT_TRUE(found.found) << found.reason;
  EXPECT_LT((found.T_world_sensor.translation() - truth.translation()).norm(), 0.05);
  EXPECT_LT(Eigen::AngleAxisd(Matrix3(found.T_world_sensor.linear().transpose() * truth.linear()))
                .angle(),
            0.02);
}

/// Its cloud says where a lost camera may be, and the features of the views there that it is,
/// however many views are nearer to where it was lost.
TEST(ViewMap, FindsALostCameraWhereItsCloudFits) {
  ViewMap map(params());
  map.insert(see(map, shoot(poseAt(0.0), 0.0, 1)), poseAt(0.0));
  for (int i = 0; i < 10; ++i)
    map.insert(see(map, shoot(poseAt(30.0 + 0.3 * i), 0.0, 2)), poseAt(30.0 + 0.3 * i));
  const Pose truth = poseAt(0.3, 0.1);
  const ViewMap::ViewPtr view = see(map, shoot(truth, 0.0, 1));
  const ViewMap::Location found =
      map.locate(view, poseAt(33.0), {{truth, true}}, ViewGuess::Nothing);
  ASSERT_TRUE(found.found) << found.reason;
  EXPECT_LT((found.T_world_sensor.translation() - truth.translation()).norm(), 0.05);
  EXPECT_FALSE(map.locate(view, poseAt(33.0), {{poseAt(33.0), true}}, ViewGuess::Nothing).found);
}

/// A turn and a shift that make up for each other move what is before the camera by next to
/// nothing, but not its depth.
TEST(ViewMap, DepthsTellATurnFromAShift) {
  ViewMap map(params());
  map.insert(see(map, shoot(poseAt(0.0), 0.0, 1)), poseAt(0.0));
  const Pose truth = poseAt(0.02, 0.01), wrong = poseAt(0.02 - 0.12 * kWall, 0.01 + 0.12);
  const ViewMap::ViewPtr view = see(map, shoot(truth, 0.0, 1));
  EXPECT_TRUE(map.fitsBetter(view, truth, wrong));
  EXPECT_FALSE(map.fitsBetter(view, wrong, truth));
  EXPECT_TRUE(map.fitsBadly(view, wrong));
  EXPECT_FALSE(map.fitsBadly(view, truth));
  EXPECT_FALSE(map.fitsBetter(view, truth, poseAt(0.02, 0.012)));  // the same place
  // Where no view shows what is looked at nothing fits.
  EXPECT_TRUE(map.fitsBetter(view, truth, poseAt(0.0, 3.0)));
  EXPECT_TRUE(map.fitsBadly(view, poseAt(0.0, 3.0)));
}

TEST(ViewMap, PanelsThatRepeatAreNoPlace) {
  // Before identical panels of 1 m nobody can tell a step of 1 m from one of 0 or 2 m.
  for (const double step : {0.5, 1.0}) {
    ViewMap map(params());
    map.insert(see(map, shoot(poseAt(0.0), 1.0, 2)), poseAt(0.0));
    const Shot shot = shoot(poseAt(step), 1.0, 2);
    const ViewMap::Location found = map.locate(
        see(map, shot), poseAt(0.0), {{poseAt(step)}, {poseAt(step - 1.0)}}, ViewGuess::Motion);
    EXPECT_FALSE(found.found) << step;
    EXPECT_NE(found.reason.find("looks the same"), std::string::npos) << found.reason;
    // Nor is a pose that something else proposes, a panel off what was expected.
    const Pose expected = poseAt(step - 0.5);
    EXPECT_EQ(map.check(see(map, shot), poseAt(step - 1.0), &expected, false),
              PoseVerdict::Ambiguous);
    // Where it is expected, it is.
    const Pose near = poseAt(step);
    EXPECT_EQ(map.check(see(map, shot), near, &near, false), PoseVerdict::Confirmed);
  }
}

/// Noise of depths, as of stereo, closes no direction.
TEST(ViewMap, BricksThatRepeatAreNoPlaceHoweverDepthsScatter) {
  constexpr double kBrick = 0.5;  // metres
  ViewMapParams noisy = params();
  noisy.camera.depth_error_growth = 0.002;
  ViewMap map(noisy);
  Random random(11);
  const auto seeBricks = [&](double x) {
    Shot shot = shoot(poseAt(x), kBrick, 2);
    for (std::size_t i = 0; i < shot.xyz.size(); i += 3) {
      const double factor = 1.0 + noisy.camera.depthError(kWall) / kWall * random.normal();
      for (std::size_t k = i; k < i + 3; ++k) shot.xyz[k] *= static_cast<float>(factor);
    }
    return see(map, shot);
  };
  map.insert(seeBricks(0.0), poseAt(0.0));
  const Pose expected = poseAt(0.0);
  const Pose next = poseAt(0.1 + kBrick);
  EXPECT_EQ(map.check(seeBricks(0.1), next, &expected, false), PoseVerdict::Ambiguous);
}

/// A plain pillar in front of the wall, over the columns [first, last).
void standBefore(Shot& shot, int first, int last, double depth) {
  for (int row = 0; row < 240; ++row) {
    for (int column = first; column < last; ++column) {
      const std::size_t i = static_cast<std::size_t>(row) * 320 + static_cast<std::size_t>(column);
      shot.image.pixels[i] = 50;
      const Vector3 point = depth * camera().rayOf(column, row);
      for (int k = 0; k < 3; ++k) shot.xyz[3 * i + static_cast<std::size_t>(k)] = float(point[k]);
    }
  }
}

/// A view of the wall with somebody over the columns [first, last).
ViewMap::ViewPtr seeBehind(const ViewMap& map, const Pose& pose, int first, int last,
                           std::uint64_t seed = 5) {
  Shot shot = shoot(pose, 0.0, seed);
  standBefore(shot, first, last, 1.0);
  return see(map, shot);
}

TEST(ViewMap, APersonWhoWalksThroughIsNoContradiction) {
  // A third of each view is covered by what stood elsewhere before: the views see through it.
  ViewMap map(params());
  map.insert(seeBehind(map, poseAt(0.0), 20, 130), poseAt(0.0));
  const Pose truth = poseAt(0.15, 0.05);
  const ViewMap::ViewPtr view = seeBehind(map, truth, 180, 290);
  EXPECT_EQ(map.check(view, truth, nullptr, false), PoseVerdict::Refused);
  for (const ViewGuess known : {ViewGuess::Motion, ViewGuess::Place, ViewGuess::Nothing}) {
    const ViewMap::Location found = map.locate(view, poseAt(0.0), {}, known);
    ASSERT_TRUE(found.found) << found.reason;
    EXPECT_LT((found.T_world_sensor.translation() - truth.translation()).norm(), 0.02);
  }
  const std::optional<Pose> by_features = map.locateByFeatures(view, poseAt(0.0));
  ASSERT_TRUE(by_features.has_value());
  EXPECT_LT((by_features->translation() - truth.translation()).norm(), 0.02);
  // Of another wall there are not enough that agree.
  const ViewMap::ViewPtr elsewhere = seeBehind(map, truth, 180, 290, 6);
  EXPECT_FALSE(map.locateByFeatures(elsewhere, poseAt(0.0)).has_value());
}

/// A turned view of a plain wall, with a textured board that turns with the camera.
ViewMap::ViewPtr seeWithBoard(const ViewMap& map, const Pose& pose, double depth) {
  Shot shot = shoot(pose, 0.0, 5);
  for (std::uint8_t& pixel : shot.image.pixels) pixel = 128;
  standBefore(shot, 110, 210, depth);
  for (std::size_t i = 0; i < shot.image.pixels.size(); ++i) {
    const auto column = static_cast<int>(i % 320), row = static_cast<int>(i / 320);
    if (column >= 110 && column < 210)
      shot.image.pixels[i] = std::uint8_t(test::wallTone(column / 125.0, row / 125.0, 0.0, 7));
  }
  return see(map, shot);
}

TEST(ViewMap, AThingThatMovesWithTheCameraIsNoStandstill) {
  // A third of the view, near or hardly before the wall: all features and gray values are on it.
  for (const double depth : {0.6, 1.7}) {
    for (const double yaw : {0.2, 0.3}) {
      ViewMap map(params());
      map.insert(seeWithBoard(map, poseAt(0.0), depth), poseAt(0.0));
      const ViewMap::ViewPtr view = seeWithBoard(map, poseAt(0.0, yaw), depth);
      EXPECT_EQ(map.check(view, poseAt(0.0), nullptr, false), PoseVerdict::Refused);
      EXPECT_FALSE(map.locateByFeatures(view, poseAt(0.0)).has_value()) << depth << ' ' << yaw;
      for (const ViewGuess known : {ViewGuess::Motion, ViewGuess::Place, ViewGuess::Nothing})
        EXPECT_FALSE(map.locate(view, poseAt(0.0), {{poseAt(0.0)}}, known).found) << depth;
    }
  }
}

/// Poses that have drifted by 0.1 m when the camera comes back: the views of before contradict, the
/// latest do not. Where nothing is expected those next to a pose are asked.
TEST(ViewMap, WhoComesBackGoesOnByTheLatestViews) {
  ViewMap map(params());
  map.insert(see(map, shoot(poseAt(0.0), 0.0, 5)), poseAt(0.1));
  map.insert(see(map, shoot(poseAt(0.02), 0.0, 5)), poseAt(0.12));
  map.insert(see(map, shoot(poseAt(0.3), 0.0, 5)), poseAt(0.3));
  map.insert(see(map, shoot(poseAt(0.2), 0.0, 5)), poseAt(0.2));
  const ViewMap::ViewPtr view = see(map, shoot(poseAt(0.11), 0.0, 5));
  const Pose expected = poseAt(0.1);
  EXPECT_EQ(map.check(view, poseAt(0.11), &expected, false), PoseVerdict::Confirmed);
  EXPECT_NE(map.check(view, poseAt(0.11), nullptr, false), PoseVerdict::Confirmed);
}

/// Half of it looks otherwise, and it sees through a board: each alone would pass.
TEST(ViewMap, WhatLittleSpeaksForIsDoubtful) {
  const Pose pose = poseAt(0.0);
  const Shot other = shoot(pose, 0.0, 9);
  const auto verdictOf = [&](std::size_t first_other, int board) {
    ViewMap map(params());
    map.insert(seeBehind(map, pose, 20, 20 + board), pose);
    Shot shot = shoot(pose, 0.0, 5);
    for (std::size_t i = 0; i < shot.image.pixels.size(); ++i)
      if (i % 320 >= first_other) shot.image.pixels[i] = other.image.pixels[i];
    return map.check(see(map, shot), pose, nullptr, false);
  };
  EXPECT_EQ(verdictOf(190, 0), PoseVerdict::Confirmed);
  EXPECT_EQ(verdictOf(320, 50), PoseVerdict::Confirmed);
  EXPECT_EQ(verdictOf(190, 50), PoseVerdict::Doubtful);
}

TEST(ViewMap, OfAFullViewWhatIsJustExpectedIsEnough) {
  // Four fifths of both views together are covered by somebody.
  ViewMap map(params());
  map.insert(seeBehind(map, poseAt(0.0), 20, 150), poseAt(0.0));
  const Pose truth = poseAt(0.05, 0.02);
  const ViewMap::ViewPtr view = seeBehind(map, truth, 170, 300);
  const ViewMap::Location found = map.locate(view, truth, {}, ViewGuess::Motion);
  ASSERT_TRUE(found.found) << found.reason;
  EXPECT_LT((found.T_world_sensor.translation() - truth.translation()).norm(), 0.04);
  // Elsewhere than expected, or where nothing is expected, it is not.
  EXPECT_FALSE(map.locate(view, poseAt(-0.2), {}, ViewGuess::Motion).found);
  EXPECT_FALSE(map.locate(view, truth, {}, ViewGuess::Place).found);
}

TEST(ViewMap, BeforeDoorsAlikeAStepIsNoStandstill) {
  // A step of 1.4 m before doors 1.5 m apart looks like one of -0.1 m, which overlaps far more.
  ViewMap map(params());
  map.insert(see(map, shoot(poseAt(0.0), 1.5, 3)), poseAt(0.0));
  const ViewMap::ViewPtr view = see(map, shoot(poseAt(1.4), 1.5, 3));
  for (const ViewGuess known : {ViewGuess::Place, ViewGuess::Nothing}) {
    const ViewMap::Location found = map.locate(view, poseAt(0.0), {{poseAt(1.4)}}, known);
    EXPECT_FALSE(found.found) << found.T_world_sensor.translation().transpose();
  }
}

/// What repeats, such as doors, looks much the same a door farther; but what hangs between them
/// does not, and features of the view before are not where they would be.
TEST(ViewMap, AWallOfThatShapeWithOtherFeaturesIsNoPlace) {
  const auto mixed = [](const Pose& pose, std::uint64_t seed) {
    Shot shot = shoot(pose, 0.0, 11);
    const Shot other = shoot(pose, 0.0, seed);
    for (std::size_t i = 0; i < shot.image.pixels.size(); ++i) {
      shot.image.pixels[i] =
          static_cast<std::uint8_t>((shot.image.pixels[i] + other.image.pixels[i]) / 2);
    }
    return shot;
  };
  ViewMap map(params());
  map.insert(see(map, mixed(poseAt(0.0), 12)), poseAt(0.0));
  const Pose place = poseAt(0.1, 0.05);
  const ViewMap::ViewPtr elsewhere = see(map, mixed(place, 13));
  EXPECT_EQ(map.check(elsewhere, place, &place, false), PoseVerdict::Confirmed);
  EXPECT_EQ(map.check(elsewhere, place, nullptr, false), PoseVerdict::Ambiguous);
  for (const ViewGuess known : {ViewGuess::Motion, ViewGuess::Place, ViewGuess::Nothing}) {
    const ViewMap::Location found = map.locate(elsewhere, place, {{place}}, known);
    EXPECT_FALSE(found.found) << found.T_world_sensor.translation().transpose();
  }
  const ViewMap::ViewPtr same = see(map, mixed(place, 12));
  EXPECT_EQ(map.check(same, place, nullptr, false), PoseVerdict::Confirmed);
  EXPECT_TRUE(map.locate(same, place, {{place}}, ViewGuess::Place).found);
}

/// Round a corner most of what is seen was hidden before, and in other light it hardly looks the
/// same: too little for views and features, enough for a place that the cloud gives.
TEST(ViewMap, RoundACornerAPlaceOfTheCloudIsBelieved) {
  const Pose truth = poseAt(1.2);
  const auto found = [&](double period, const Pose& candidate, bool fits) {
    ViewMap map(params());
    Shot before = shoot(poseAt(0.0), period, 8);
    standBefore(before, 0, 240, 1.0);
    map.insert(see(map, before), poseAt(0.0));
    Shot now = shoot(truth, period, 8);
    const Shot other = shoot(truth, 0.0, 9);
    for (std::size_t i = 0; i < now.image.pixels.size(); ++i) {
      now.image.pixels[i] =
          static_cast<std::uint8_t>((now.image.pixels[i] + other.image.pixels[i]) / 2);
    }
    const ViewMap::ViewPtr view = see(map, now);
    EXPECT_EQ(map.check(view, truth, nullptr, false), PoseVerdict::Refused);
    return map.locate(view, poseAt(1.0), {{candidate, fits}}, ViewGuess::Motion).found;
  };
  EXPECT_TRUE(found(0.0, truth, true));
  EXPECT_FALSE(found(0.0, truth, false));       // nothing says that the cloud fits
  EXPECT_FALSE(found(0.3, truth, true));        // the same 0.3 m farther
  EXPECT_FALSE(found(0.0, poseAt(0.9), true));  // gray values do not agree
  Pose nearer = truth;
  nearer.translation().z() = -0.4;  // behind what was seen through
  EXPECT_FALSE(found(0.0, nearer, true));
}

TEST(ViewMap, RefiningStaysAtThePlace) {
  ViewMap map(params());
  map.insert(see(map, shoot(poseAt(0.0), 0.0, 7)), poseAt(0.0));
  const ViewMap::ViewPtr view = see(map, shoot(poseAt(0.3), 0.0, 7));
  const std::optional<Pose> near = map.refined(view, poseAt(0.28));
  ASSERT_TRUE(near.has_value());
  EXPECT_LT((near->translation() - poseAt(0.3).translation()).norm(), 0.02);
  // From farther it would climb to another place, or stay where it is no maximum.
  const std::optional<Pose> far = map.refined(view, poseAt(0.3, 0.3));
  EXPECT_TRUE(!far || (far->translation() - poseAt(0.3).translation()).norm() > 0.02);
}

TEST(ViewMap, AViewTwiceIsWhereItWas) {
  ViewMap map(params());
  const Shot shot = shoot(poseAt(0.0), 0.0, 3);
  map.insert(see(map, shot), poseAt(0.0));
  const ViewMap::Location found = map.locate(see(map, shot), poseAt(0.5), {}, ViewGuess::Motion);
  ASSERT_TRUE(found.found) << found.reason;
  EXPECT_LT(found.T_world_sensor.translation().norm(), 1e-3);
}

TEST(ViewMap, RefusesAnImageOfAnotherPlaceAndDepthsThatCannotBe) {
  ViewMap map(params());
  map.insert(see(map, shoot(poseAt(0.0), 0.0, 4)), poseAt(0.0));
  // Images exchanged: the depth of one view, the image of another.
  const ViewMap::ViewPtr exchanged = see(map, shoot(poseAt(0.0), 0.0, 5));
  EXPECT_EQ(map.check(exchanged, poseAt(0.0), nullptr, false), PoseVerdict::Refused);
  EXPECT_FALSE(map.locate(exchanged, poseAt(0.0), {}, ViewGuess::Motion).found);
  // Its wall would stand where the earlier view saw through.
  const ViewMap::ViewPtr same = see(map, shoot(poseAt(0.0), 0.0, 4));
  Pose nearer = poseAt(0.0);
  nearer.translation().z() = -0.6;
  EXPECT_EQ(map.check(same, nearer, nullptr, false), PoseVerdict::Refused);
}

TEST(ViewMap, PlainWallsTellNothing) {
  ViewMap map(params());
  Shot plain = shoot(poseAt(0.0), 0.0, 6);
  for (std::uint8_t& pixel : plain.image.pixels) pixel = 128;
  map.insert(see(map, plain), poseAt(0.0));
  EXPECT_EQ(map.check(see(map, plain), poseAt(0.0), nullptr, false), PoseVerdict::Unknown);
  EXPECT_FALSE(map.locate(see(map, plain), poseAt(0.0), {{poseAt(0.0)}}, ViewGuess::Motion).found);
}

}  // namespace
}  // namespace planar_mapping
