// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/atlas/atlas_localizer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "painted_room.h"
#include "planar_mapping/atlas/keyframe_maker.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping {
namespace {

constexpr int kTurn = 24;  // frames

Keyframe keyframeOf(const test::PaintedView& view) {
  FeatureCamera camera;
  camera.setPinhole(view.camera);
  return makeKeyframe(view.gray, view.frame().points, camera);
}

/// A frame from between those of the atlas.
Pose between() {
  return test::aroundRoom(5, kTurn) *
         motionStep((Vector6() << 0.1, -0.03, 0.08, 0.02, 0.06, -0.03).finished());
}

class Localizing : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    AtlasBuilder builder({6, 100.0}, test::paintedMapParams(), {0, "room", ""});
    for (int i = 0; i < kTurn; ++i) {
      const Pose pose = test::aroundRoom(i, kTurn);
      test::addView(builder, static_cast<std::size_t>(i), test::lookAtPaint(pose, 1), pose);
    }
    room_ = builder.data();
  }
  static void TearDownTestSuite() { room_ = {}; }

  static AtlasData room_;
};

AtlasData Localizing::room_;

TEST_F(Localizing, AFrameIsFoundInTheWorldOfItsComponent) {
  AtlasData atlas = room_;
  // The whole building has been moved since.
  const Pose T_world_room = motionStep((Vector6() << 7.0, -2.0, 0.5, 0.1, 0.2, 1.5).finished());
  for (Submap& submap : atlas.submaps) {
    submap.T_world_submap = T_world_room * submap.T_world_submap;
    submap.component = 40;
    submap.session = 3;
  }
  const std::optional<Place> place =
      AtlasLocalizer(atlas).find(keyframeOf(test::lookAtPaint(between(), 1)));
  ASSERT_TRUE(place);
  EXPECT_EQ(40, place->component);
  EXPECT_EQ(3, place->session);
  const Keyframe& key = atlas.keyframes[static_cast<std::size_t>(place->keyframe)];
  EXPECT_EQ(place->submap, key.submap);
  EXPECT_GE(place->evidence.inliers, 12u);
  EXPECT_GE(place->evidence.matches, place->evidence.inliers);
  const Pose truth = T_world_room * between();
  const Pose off = place->T_world_sensor * truth.inverse();
  Vector6 error;
  error << place->T_world_sensor.translation() - truth.translation(),
      rotationAngle(off.linear()) * Eigen::AngleAxisd(off.linear()).axis();
  std::printf("off by %.1f mm, %.3f deg\n", 1e3 * error.head<3>().norm(),
              error.tail<3>().norm() / kRadiansPerDegree);
  EXPECT_LT(error.head<3>().norm(), 0.02);
  EXPECT_LT(error.dot(place->covariance.inverse() * error), 22.46);
  // Of the sensor's position, not of that of the world's origin 7 m away.
  const double deviation = std::sqrt(place->covariance.diagonal().head(3).maxCoeff());
  EXPECT_LT(deviation, 0.04);
  EXPECT_GT(deviation, 0.002);
}

TEST_F(Localizing, IdsAndPoseOfTheFrameDoNotMatter) {
  const AtlasLocalizer localizer(room_);
  Keyframe frame = keyframeOf(test::lookAtPaint(between(), 1));
  const std::optional<Place> first = localizer.find(frame);
  frame.id = 5;
  frame.submap = 0;
  frame.T_submap_keyframe = test::aroundRoom(9, kTurn);
  const std::optional<Place> second = localizer.find(frame);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->keyframe, second->keyframe);
  EXPECT_EQ(first->T_world_sensor.matrix(), second->T_world_sensor.matrix());
}

TEST_F(Localizing, AnotherRoomIsNotFound) {
  const AtlasLocalizer localizer(room_);
  for (int i = 0; i < kTurn; i += 4)
    EXPECT_FALSE(localizer.find(keyframeOf(test::lookAtPaint(test::aroundRoom(i, kTurn), 2)))) << i;
}

TEST_F(Localizing, TwoPlacesOfOneLookAreNeither) {
  AtlasData twice = room_;
  for (Submap& submap : twice.submaps) {
    submap.id += 10;
    submap.T_world_submap.translation().x() += 8.0;
    submap.component = room_.submaps.front().component;
  }
  for (Keyframe& key : twice.keyframes) {
    key.id += 100;
    key.submap += 10;
  }
  AtlasData atlas = room_;
  atlas.submaps.insert(atlas.submaps.end(), twice.submaps.begin(), twice.submaps.end());
  atlas.keyframes.insert(atlas.keyframes.end(), twice.keyframes.begin(), twice.keyframes.end());
  const Keyframe frame = keyframeOf(test::lookAtPaint(between(), 1));
  EXPECT_FALSE(AtlasLocalizer(atlas).find(frame));
  // Of two components nobody knows whether they are two places.
  for (std::size_t i = room_.submaps.size(); i < atlas.submaps.size(); ++i)
    atlas.submaps[i].component = 10;
  EXPECT_TRUE(AtlasLocalizer(atlas).find(frame));
}

TEST_F(Localizing, NothingIsFoundByNothing) {
  test::PaintedView view = test::lookAtPaint(between(), 1);
  EXPECT_FALSE(AtlasLocalizer(AtlasData()).find(keyframeOf(view)));
  view.gray = uniform(view.gray.width, view.gray.height, 90.0);
  EXPECT_FALSE(AtlasLocalizer(room_).find(keyframeOf(view)));
  Keyframe other = keyframeOf(test::lookAtPaint(between(), 1));
  other.descriptors.pop_back();
  EXPECT_THROW(AtlasLocalizer(room_).find(other), InputError);
}

}  // namespace
}  // namespace planar_mapping
