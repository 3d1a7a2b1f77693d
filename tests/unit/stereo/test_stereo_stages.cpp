// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <set>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/stage_table.h"
#include "planar_mapping/stereo/rectification.h"
#include "stereo_images.h"

namespace planar_mapping {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;

/// A stage of the table with its default parameters but one.
std::unique_ptr<Stage> stage(const std::string& name, const std::string& key = "",
                             const ParameterValue& value = {}) {
  StageTable table;
  registerBuiltinStages(table);
  const StageEntry* entry = table.find(name);
  if (entry == nullptr) throw InputError("no stage " + name);
  std::unique_ptr<Stage> made = entry->make();
  ParameterTable parameters;
  made->declare(parameters);
  if (!key.empty()) parameters.find(key)->set(value);
  made->configure(RunSettings());
  return made;
}

Frame frameOf(const ImagePair& pair) {
  Frame frame;
  frame.source = "left/000000.png";
  frame.cloud = pcl::make_shared<FrameCloud>();
  frame.images.left = pair.left;
  frame.images.right = pair.right;
  frame.images.calibration = pairCalibration(kWidth, kHeight);
  return frame;
}

double statistic(const Frame& frame, const std::string& name) {
  for (const FrameStatistic& entry : frame.statistics) {
    if (entry.name == name) return entry.value;
  }
  ADD_FAILURE() << "no statistic " << name;
  return -1.0;
}

ImagePair goodPair(std::uint32_t seed = 1) {
  return pairOf(Pattern(seed), {20.0, 0.0, 0.0}, kWidth, kHeight);
}

TEST(StereoMatchingStage, MakesAnOrganizedCloudWithHoles) {
  Frame frame = frameOf(goodPair());
  stage("stereo_matching")->process(frame);
  EXPECT_EQ(frame.skip_reason, "");
  ASSERT_EQ(frame.cloud->width, 320u);
  ASSERT_EQ(frame.cloud->height, 240u);
  ASSERT_TRUE(frame.camera);
  EXPECT_DOUBLE_EQ(frame.camera->fx, 300.0);
  EXPECT_DOUBLE_EQ(frame.baseline.value_or(0.0), 0.1);
  EXPECT_NEAR(frame.cloud->at(200, 100).z, 1.5, 0.02);  // f B / d
  EXPECT_NEAR(frame.cloud->at(200, 100).x, (200 - 159.5) / 300.0 * 1.5, 0.01);
  EXPECT_TRUE(std::isnan(frame.cloud->at(3, 100).z));  // has no partner
  EXPECT_GT(statistic(frame, "stereo_density"), 0.8);
  EXPECT_GT(statistic(frame, "disparities_px"), 0.0);
}

TEST(StereoMatchingStage, FramesThatCannotBeUsedSayWhy) {
  const auto reason = [](const ImagePair& pair) {
    Frame frame = frameOf(pair);
    stage("stereo_matching")->process(frame);
    return frame.skip_reason;
  };
  const ImagePair good = goodPair();
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(reason({good.left, io::Image()}), "there is no right image");
  has(reason({io::Image(), good.right}), "there is no left image");
  has(reason({good.left, uniform(100, 50, 9.0)}),
      "the left image is 320 x 240 pixels, the right one 100 x 50");
  has(reason({good.right, good.left}), "disparities are negative");
  const io::Image black = uniform(kWidth, kHeight, 0.0);
  has(reason({black, black}), "is black");
  const io::Image plain = uniform(kWidth, kHeight, 150.0);
  has(reason({plain, plain}), "no texture");
}

TEST(StereoMatchingStage, InputThatIsNoPairIsAnError) {
  Frame frame = frameOf({});
  EXPECT_THROW(stage("stereo_matching")->process(frame), InputError);
  frame = frameOf(goodPair());
  frame.images.calibration.reset();
  EXPECT_THROW(stage("stereo_matching")->process(frame), InputError);
  EXPECT_THROW(stage("stereo_matching", "block_size_px", std::int64_t{4}), ParameterError);
}

TEST(StereoMatchingStage, APairThatIsNotRectifiedIsRectifiedFirst) {
  Frame frame = frameOf(goodPair());
  io::UnrectifiedPair pair;
  pair.right_camera = frame.images.calibration->camera;
  // Rolled a little: rows of the raw images do not fit.
  pair.T_right_left.linear() = Eigen::AngleAxisd(0.01, Vector3::UnitZ()).toRotationMatrix();
  pair.T_right_left.translation() = Vector3(-0.1, 0.0, 0.0);
  frame.images.calibration->unrectified = pair;
  const Rectifier rectifier(*frame.images.calibration);
  Pose given = Pose::Identity();
  given.linear() = Eigen::AngleAxisd(0.4, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  given.translation() = Vector3(4, 5, 6);
  frame.given_pose = given;
  frame.T_world_sensor = given;
  stage("stereo_matching")->process(frame);
  // A point stays where it is in the world, though the camera that sees it has turned.
  const Vector3 in_left(0.3, -0.2, 2.0);
  ASSERT_GT((rectifier.rotation() - Matrix3::Identity()).norm(), 0.005);
  const Vector3 in_rectified = rectifier.rotation() * in_left;
  EXPECT_LT((frame.T_world_sensor * in_rectified - given * in_left).norm(), 1e-12);
  EXPECT_EQ(frame.given_pose->matrix(), frame.T_world_sensor.matrix());
  ASSERT_TRUE(frame.images.calibration);
  EXPECT_FALSE(frame.images.calibration->unrectified);
  EXPECT_NEAR(frame.images.calibration->baseline.value_or(0.0), 0.1, 1e-9);
  ASSERT_TRUE(frame.camera);
  EXPECT_DOUBLE_EQ(frame.camera->fx, frame.images.calibration->camera.fx);
}

TEST(KeyFeaturesStage, FollowsFeaturesOfPairs) {
  const auto matching = stage("stereo_matching");
  const auto features = stage("key_features");
  std::set<std::int64_t> known;
  for (int i = 0; i < 2; ++i) {
    Frame frame = frameOf(pairOf(Pattern(2), {20.0, 0.0, 0.0}, kWidth, kHeight, 4.0 * i));
    matching->process(frame);
    features->process(frame);
    ASSERT_EQ(frame.skip_reason, "");
    ASSERT_GT(frame.key_features.size(), 60u);
    std::size_t again = 0;
    for (const KeyFeature& feature : frame.key_features) {
      again += known.count(feature.track);
      known.insert(feature.track);
    }
    EXPECT_EQ(static_cast<double>(again), statistic(frame, "tracked") + statistic(frame, "reseen"));
    if (i > 0) {
      EXPECT_GT(again, frame.key_features.size() / 2);
    }
    EXPECT_EQ(statistic(frame, "stereo_matches"), static_cast<double>(frame.key_features.size()));
    EXPECT_GE(statistic(frame, "features_left"), statistic(frame, "stereo_matches"));
    EXPECT_EQ(statistic(frame, "features_right"), 0.0);  // the cloud has the depth of enough
  }
}

TEST(KeyFeaturesStage, SaysThatLeftAndRightAreExchanged) {
  const ImagePair good = goodPair(3);
  Frame frame = frameOf({good.right, good.left});
  stage("key_features")->process(frame);
  EXPECT_NE(frame.skip_reason.find("negative disparity"), std::string::npos) << frame.skip_reason;
}

/// A wall 2 m ahead as depth image or PCD file would give it.
Frame wallFrame(bool with_image) {
  Frame frame;
  frame.cloud = pcl::make_shared<FrameCloud>(kWidth, kHeight);
  const PinholeCamera camera = pairCalibration(kWidth, kHeight).camera;
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      frame.cloud->at(column, row) =
          pcl::PointXYZ(static_cast<float>((column - camera.cx) / camera.fx * 2.0),
                        static_cast<float>((row - camera.cy) / camera.fy * 2.0), 2.0f);
    }
  }
  if (with_image) frame.images.left = goodPair(4).left;
  return frame;
}

TEST(KeyFeaturesStage, TakesDepthOfTheCloudForASingleImage) {
  Frame frame = wallFrame(true);
  stage("key_features")->process(frame);
  ASSERT_GT(frame.key_features.size(), 60u);
  for (const KeyFeature& feature : frame.key_features) EXPECT_NEAR(feature.position.z(), 2.0, 1e-6);
}

TEST(KeyFeaturesStage, SamplesCloudsWithoutAnImage) {
  const auto features = stage("key_features");
  for (int i = 0; i < 2; ++i) {
    Frame frame = wallFrame(false);
    frame.given_pose = Pose::Identity();
    features->process(frame);
    ASSERT_GT(frame.key_features.size(), 100u);
    for (const KeyFeature& feature : frame.key_features) {
      EXPECT_EQ(feature.sightings, i + 1);
      EXPECT_TRUE(std::isnan(feature.column));
    }
  }
}

TEST(KeyFeaturesStage, TheSourceCanBeChosen) {
  Frame frame = wallFrame(true);
  stage("key_features", "source", std::string("cloud"))->process(frame);
  EXPECT_TRUE(std::isnan(frame.key_features.at(0).column));
  frame = wallFrame(false);
  EXPECT_THROW(stage("key_features", "source", std::string("image"))->process(frame), InputError);
}

}  // namespace
}  // namespace planar_mapping
