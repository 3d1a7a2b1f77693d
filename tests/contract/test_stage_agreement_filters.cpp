// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// GroundRemoval and KLOccupancyFilter give what the stages of the same names give, to the bit: the
// same points are ground and every point has the same probability.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "ground_scene.h"
#include "occupancy_experiment.h"
#include "pipeline_frames.h"
#include "planar_mapping/filters/ground_removal.h"
#include "planar_mapping/filters/kl_occupancy_filter.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "real_data.h"

namespace planar_mapping {
namespace {

/// Both ways at once, frame by frame.
class Agreement {
 public:
  void expectEqual(Frame frame) {
    const FrameCloud::Ptr cloud = frame.cloud;
    pipeline_.process(frame);
    ASSERT_EQ(frame.skip_reason, "");

    ground_.setInputCloud(cloud);
    ground_.setSensorPose(frame.T_world_sensor);
    pcl::Indices kept;
    ground_.filter(kept);
    EXPECT_EQ(kept, frame.indices) << frame.source;
    ground_points_ += frame.ground.size();

    std::vector<std::int32_t> labels(cloud->size(), -1);
    for (std::size_t plane = 0; plane < frame.planes.size(); ++plane) {
      for (const int i : frame.planes[plane].inliers)
        labels[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(plane);
    }
    occupancy_.setInputCloud(cloud);
    occupancy_.setIndices(pcl::make_shared<pcl::Indices>(kept));
    occupancy_.setSensorPose(frame.T_world_sensor);
    occupancy_.setInputPlaneLabels(labels);
    occupancy_.setInputKeyFeatures(frame.key_features);
    occupancy_.setMotion(frame.motion);
    pcl::Indices believed;
    occupancy_.filter(believed);
    EXPECT_EQ(occupancy_.getProbabilities(), frame.probability) << frame.source;
    pcl::Indices expected;
    for (const int i : frame.indices) {
      if (frame.probability[static_cast<std::size_t>(i)] >= 0.5f) expected.push_back(i);
    }
    EXPECT_EQ(believed, expected) << frame.source;
    removed_ += frame.indices.size() - believed.size();
    matches_ += frame.matches;
  }
  std::size_t groundPoints() const { return ground_points_; }
  std::size_t removed() const { return removed_; }
  std::size_t matches() const { return matches_; }

 private:
  Pipeline pipeline_{test::configurationOf(
      "  - stage: ground_removal\n  - stage: multi_plane_segmentation\n  - stage: kl_occupancy\n")};
  GroundRemoval<pcl::PointXYZ> ground_;
  KLOccupancyFilter<pcl::PointXYZ> occupancy_;
  std::size_t ground_points_ = 0;
  std::size_t removed_ = 0;
  std::size_t matches_ = 0;
};

Frame frameOf(const std::vector<float>& xyz, int width, int height) {
  Frame frame;
  frame.source = "generated";
  frame.cloud = pcl::make_shared<FrameCloud>();
  for (std::size_t i = 0; i < xyz.size(); i += 3)
    frame.cloud->push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
  frame.cloud->width = static_cast<std::uint32_t>(width);
  frame.cloud->height = static_cast<std::uint32_t>(height);
  return frame;
}

test::GroundScene sceneOf(double camera_height, double pitch) {
  test::GroundScene scene;
  scene.camera_height = camera_height;
  scene.pitch = pitch;
  scene.wall_distance = 3.0;
  scene.disparity_noise = 0.3;
  scene.render();
  return scene;
}

TEST(FilterStages, AgreeOnACameraOverAFloor) {
  for (const double height : {0.37, 1.4}) {
    const test::GroundScene scene = sceneOf(height, 0.15);
    Agreement agreement;
    agreement.expectEqual(frameOf(scene.xyz, scene.width, scene.height));
    EXPECT_GT(agreement.groundPoints(), 2000u) << height;
  }
}

TEST(FilterStages, AgreeOnAScanWithZUp) {
  const test::GroundScene scene = sceneOf(1.2, 0.1);
  Agreement agreement;
  agreement.expectEqual(frameOf(scene.robotFrame(), static_cast<int>(scene.truth.size()), 1));
  EXPECT_GT(agreement.groundPoints(), 2000u);
}

TEST(FilterStages, AgreeOnATiltedCameraWithItsPose) {
  const test::GroundScene scene = sceneOf(1.2, 0.7);
  Frame frame = frameOf(scene.xyz, scene.width, scene.height);
  frame.T_world_sensor.linear() = scene.levelFromCamera();
  frame.T_world_sensor.translation() = Vector3(3.0, -2.0, 1.2);
  Agreement agreement;
  agreement.expectEqual(frame);
  EXPECT_GT(agreement.groundPoints(), 2000u);
}

TEST(FilterStages, AgreeOnASequenceOfCloudsWithPoses) {
  Agreement agreement;
  for (const test::View& view : test::noisyWalk({0, 1, 2, 1, 0, 1})) {
    Frame frame = frameOf(view.xyz, view.camera.width, view.camera.height);
    frame.T_world_sensor = view.pose;
    agreement.expectEqual(frame);
  }
  EXPECT_GT(agreement.matches(), 500u);
  EXPECT_GT(agreement.removed(), 100u);
}

TEST(FilterStages, AgreeOnASequenceWithTracks) {
  Agreement agreement;
  std::size_t number = 0;
  for (const test::OutlierFrame& seen : test::outlierFrames(0.1, 6)) {
    const test::View& view = seen.view;
    Frame frame = frameOf(view.xyz, view.camera.width, view.camera.height);
    frame.number = number++;
    frame.T_world_sensor = view.pose;
    // One frame without features is taken by cells, the next has a motion that is not its own.
    if (number != 4) frame.key_features = seen.features;
    if (number != 3) frame.motion = seen.motion;
    agreement.expectEqual(frame);
  }
  EXPECT_GT(agreement.matches(), 500u);
  EXPECT_GT(agreement.removed(), 100u);
}

class RealFilterStages : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (test::isMissing(GetParam())) GTEST_SKIP() << "no " << GetParam();
  }
};

TEST_P(RealFilterStages, Agree) {
  Configuration configuration = test::configurationOf("  - stage: kl_occupancy\n");
  configuration.inputs = {test::realData(GetParam())};
  configuration.frames.last = 5;
  SequenceSource source(configuration);
  Agreement agreement;
  std::size_t frames = 0;
  for (; std::optional<Frame> frame = source.next(); ++frames) agreement.expectEqual(*frame);
  EXPECT_GT(frames, 0u);
}

INSTANTIATE_TEST_SUITE_P(Clouds, RealFilterStages,
                         testing::Values("clouds_pcl/office1.pcd", "clouds_pcl/room_scan1.pcd",
                                         "clouds_pcl/capture0001.pcd",
                                         "clouds_pcl/table_scene_mug_stereo_textured.pcd",
                                         "clouds_steps/tilted_steps.pcd",
                                         "clouds_velodyne/street_scan.pcd"));
INSTANTIATE_TEST_SUITE_P(Sequences, RealFilterStages,
                         testing::Values("rgbd_tum_cabinet", "rgbd_icl_five"));

}  // namespace
}  // namespace planar_mapping
