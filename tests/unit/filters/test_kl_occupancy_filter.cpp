// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/filters/kl_occupancy_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

/// Two features side by side in one cell, a third that jumps from frame to frame.
Cloud::Ptr frameOf(float jump) {
  Cloud::Ptr cloud(new Cloud);
  cloud->push_back({0.01f, 0.05f, 2.05f});
  cloud->push_back({0.02f, 0.05f, 2.05f});
  cloud->push_back({0.03f + jump, 0.05f, 2.05f});
  return cloud;
}

TEST(KLOccupancyFilter, BelievesWhatIsSeenAgainAndDoubtsWhatJumps) {
  KLOccupancyFilter<pcl::PointXYZ> filter(true);
  filter.setInputTracks({1, 2, 3});
  Cloud output;
  for (const float jump : {0.0f, 0.3f, 0.0f, 0.3f}) {
    filter.setMotion(Pose::Identity(), 1e-6 * Matrix6::Identity());
    filter.setInputCloud(frameOf(jump));
    filter.filter(output);
  }
  EXPECT_EQ(output.size(), 2u);
  EXPECT_EQ(*filter.getRemovedIndices(), (pcl::Indices{2}));
  EXPECT_GT(filter.getProbabilities()[0], 0.9f);
  EXPECT_LT(filter.getProbabilities()[2], 0.1f);
  EXPECT_EQ(filter.getBeliefs().size(), 3u);
  EXPECT_EQ(filter.getDiagnostics().beliefs.updated, 3u);
}

TEST(KLOccupancyFilter, ResetForgetsBeliefsAndKeepsParameters) {
  KLOccupancyFilter<pcl::PointXYZ> filter;
  filter.setMinProbability(0.4);
  filter.setInputTracks({1, 2, 3});
  filter.setInputCloud(frameOf(0.0f));
  pcl::Indices kept;
  filter.filter(kept);
  const std::vector<float> first = filter.getProbabilities();
  filter.filter(kept);
  filter.reset();
  EXPECT_EQ(filter.getBeliefs().size(), 0u);
  filter.filter(kept);
  EXPECT_EQ(filter.getProbabilities(), first);
  EXPECT_EQ(filter.getMinProbability(), 0.4);
}

TEST(KLOccupancyFilter, MotionCountsForOneFrameOnly) {
  KLOccupancyFilter<pcl::PointXYZ> filter;
  filter.setInputTracks({1, 2, 3});
  filter.setInputCloud(frameOf(0.0f));
  filter.setMotion(Pose::Identity(), Matrix6::Identity());
  pcl::Indices kept;
  filter.filter(kept);
  EXPECT_FALSE(filter.getMotion().has_value());
}

TEST(KLOccupancyFilter, NonFinitePointsAndOutsidersHaveNoProbability) {
  const auto cloud = frameOf(0.0f);
  cloud->points[1].x = std::numeric_limits<float>::quiet_NaN();
  KLOccupancyFilter<pcl::PointXYZ> filter;
  filter.setInputCloud(cloud);
  filter.setIndices(pcl::IndicesPtr(new pcl::Indices{0, 1}));
  pcl::Indices kept;
  filter.filter(kept);
  ASSERT_EQ(filter.getProbabilities().size(), 3u);
  EXPECT_EQ(filter.getProbabilities()[1], 0.0f);
  EXPECT_EQ(filter.getProbabilities()[0], 0.5f);
  EXPECT_EQ(filter.getProbabilities()[2], 0.0f);
  EXPECT_EQ(filter.getDiagnostics().points_not_measured, 1u);
}

TEST(KLOccupancyFilter, SizesThatDisagreeAreInputErrors) {
  KLOccupancyFilter<pcl::PointXYZ> filter;
  filter.setInputCloud(frameOf(0.0f));
  pcl::Indices kept;
  filter.setInputTracks({1, 2});
  EXPECT_THROW(filter.filter(kept), InputError);
  filter.setInputTracks({});
  filter.setInputPlaneLabels({1});
  EXPECT_THROW(filter.filter(kept), InputError);
  filter.setInputPlaneLabels({});
  EXPECT_NO_THROW(filter.filter(kept));
}

TEST(KLOccupancyFilter, CellsAreThoseOfTheWorld) {
  // One point of the world seen from two places: of one cell, by either way to give the pose.
  for (const bool by_cloud : {false, true}) {
    KLOccupancyFilter<pcl::PointXYZ> filter;
    pcl::Indices kept;
    for (const float ahead : {0.0f, 0.5f}) {
      Cloud::Ptr cloud(new Cloud);
      cloud->push_back({0.05f, 0.05f, 2.05f - ahead});
      Pose pose = Pose::Identity();
      pose.translation().z() = ahead;
      if (by_cloud) {
        cloud->sensor_origin_ = Eigen::Vector4f(0.0f, 0.0f, ahead, 1.0f);
      } else {
        filter.setSensorPose(pose);
      }
      filter.setInputCloud(cloud);
      filter.filter(kept);
    }
    EXPECT_EQ(filter.getDiagnostics().beliefs.updated, 1u);
    EXPECT_NEAR(filter.getProbabilities()[0], std::exp(-1.07), 1e-5);
  }
}

TEST(KLOccupancyFilter, CopiesDoNotShareBeliefs) {
  KLOccupancyFilter<pcl::PointXYZ> original;
  original.setInputTracks({1, 2, 3});
  original.setInputCloud(frameOf(0.0f));
  pcl::Indices kept;
  original.filter(kept);
  KLOccupancyFilter<pcl::PointXYZ> copy = original;
  copy.setMotion(Pose::Identity(), Matrix6::Zero());
  copy.setInputCloud(frameOf(1.0f));
  copy.filter(kept);
  EXPECT_NE(*copy.getBeliefs().belief(3), *original.getBeliefs().belief(3));
}

}  // namespace
}  // namespace planar_mapping
