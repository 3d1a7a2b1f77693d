// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/pcl/points_view.h"
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"

namespace {

/// A point type of a user, with the bare minimum and a fourth coordinate nobody sets.
struct EIGEN_ALIGN16 UserPoint {
  float x, y, z, unset;
  int track;
};

using planar_mapping::MultiPlaneSACSegmentation;

/// A floor z = -1 of 3,600 points and a wall x = 3 of 2,500, seen from the origin.
template <typename PointT>
typename pcl::PointCloud<PointT>::Ptr makeCorner() {
  typename pcl::PointCloud<PointT>::Ptr cloud(new pcl::PointCloud<PointT>);
  planar_mapping::Random random(1);
  const auto add = [&](double x, double y, double z) {
    PointT p;
    p.x = static_cast<float>(x);
    p.y = static_cast<float>(y);
    p.z = static_cast<float>(z);
    cloud->push_back(p);
  };
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 60; ++j) add(0.04 * i, 0.04 * j, -1.0 + 0.004 * random.normal());
  }
  for (int i = 0; i < 50; ++i) {
    for (int j = 0; j < 50; ++j) add(3.0 + 0.004 * random.normal(), 0.04 * i, 0.04 * j);
  }
  cloud->header.frame_id = "camera";
  cloud->header.stamp = 42;
  return cloud;
}

template <typename PointT>
class MultiPlaneSegmentation : public testing::Test {
 protected:
  MultiPlaneSegmentation() {
    segmentation_.setDistanceThreshold(0.05);
    segmentation_.setMinInliers(1000);
  }
  void segment() { segmentation_.segment(inliers_, planes_); }

  MultiPlaneSACSegmentation<PointT> segmentation_;
  std::vector<pcl::PointIndices> inliers_ = std::vector<pcl::PointIndices>(7);
  std::vector<pcl::ModelCoefficients> planes_ = std::vector<pcl::ModelCoefficients>(7);
};
using PointTypes = testing::Types<pcl::PointXYZ, pcl::PointXYZI, pcl::PointXYZL, pcl::PointXYZRGB,
                                  pcl::PointXYZRGBA, pcl::PointNormal, pcl::PointXYZRGBNormal,
                                  pcl::PointXYZINormal, UserPoint>;
TYPED_TEST_SUITE(MultiPlaneSegmentation, PointTypes);

TYPED_TEST(MultiPlaneSegmentation, FindsFloorAndWall) {
  const auto cloud = makeCorner<TypeParam>();
  this->segmentation_.setInputCloud(cloud);
  this->segment();
  ASSERT_EQ(this->planes_.size(), 2u);
  ASSERT_EQ(this->inliers_.size(), 2u);
  EXPECT_EQ(this->inliers_[0].indices.size(), 3600u);
  EXPECT_EQ(this->inliers_[1].indices.size(), 2500u);
  EXPECT_EQ(this->inliers_[1].indices.front(), 3600);
  // a x + b y + c z + d = 0, normal towards the sensor at the origin.
  ASSERT_EQ(this->planes_[0].values.size(), 4u);
  EXPECT_NEAR(this->planes_[0].values[2], 1.0f, 1e-4f);
  EXPECT_NEAR(this->planes_[0].values[3], 1.0f, 1e-3f);
  EXPECT_NEAR(this->planes_[1].values[0], -1.0f, 1e-4f);
  EXPECT_NEAR(this->planes_[1].values[3], 3.0f, 1e-3f);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(this->planes_[k].header.frame_id, "camera");
    EXPECT_EQ(this->inliers_[k].header.stamp, 42u);
  }
  const auto& segments = this->segmentation_.getPlanes();
  ASSERT_EQ(segments.size(), 2u);
  EXPECT_NEAR(segments[0].rms, 0.004, 0.0005);
  EXPECT_NEAR(segments[0].tilt, 0.0, 1e-3);
  EXPECT_NEAR(std::abs(segments[1].tilt), M_PI_2, 1e-3);
  EXPECT_GT(segments[0].covariance.trace(), 0.0);
  EXPECT_EQ(this->segmentation_.getDiagnostics().points_considered, 6100u);
}

TYPED_TEST(MultiPlaneSegmentation, ThePoseOfTheSensorInTheWorldTurnsNothing) {
  const auto cloud = makeCorner<TypeParam>();
  cloud->sensor_origin_ = Eigen::Vector4f(1.0f, 1.0f, -5.0f, 1.0f);
  cloud->sensor_orientation_ = Eigen::Quaternionf(0.0f, 1.0f, 0.0f, 0.0f);
  this->segmentation_.setInputCloud(cloud);
  this->segment();
  ASSERT_EQ(this->planes_.size(), 2u);
  EXPECT_NEAR(this->planes_[0].values[2], 1.0f, 1e-4f);
}

TYPED_TEST(MultiPlaneSegmentation, ACloudInMillimetresIsRefused) {
  const auto cloud = makeCorner<TypeParam>();
  for (TypeParam& p : *cloud) {
    p.x *= 1000.0f;
    p.y *= 1000.0f;
    p.z *= 1000.0f;
  }
  this->segmentation_.setInputCloud(cloud);
  EXPECT_THROW(this->segment(), planar_mapping::InputError);
  this->segmentation_.setDistanceThreshold(50.0);
  this->segment();
  EXPECT_EQ(this->planes_.size(), 2u);
}

TYPED_TEST(MultiPlaneSegmentation, WithoutCloudThrowsAndClearsTheOutputs) {
  EXPECT_THROW(this->segment(), planar_mapping::InputError);
  EXPECT_TRUE(this->inliers_.empty());
  EXPECT_TRUE(this->planes_.empty());
}

struct PointDouble {
  double x = 0.0, y = 0.0, z = 0.0;
};
struct PointBackwards {
  float z = 0.0f, y = 0.0f, x = 0.0f;
};
struct PointTagged {
  char tag[8] = {};
  float x = 0.0f, y = 0.0f, z = 0.0f;
};

template <typename PointT>
pcl::PointCloud<PointT> makeCloud() {
  pcl::PointCloud<PointT> cloud;
  for (int i = 0; i < 6; ++i) {
    PointT p;
    p.x = static_cast<decltype(p.x)>(i);
    p.y = static_cast<decltype(p.y)>(10 + i);
    p.z = static_cast<decltype(p.z)>(-i);
    cloud.push_back(p);
  }
  return cloud;
}

template <typename PointT>
class PointsViewOf : public testing::Test {};
using LayoutTypes = testing::Types<pcl::PointXYZ, pcl::PointXYZI, pcl::PointXYZRGBNormal,
                                   PointDouble, PointBackwards, PointTagged>;
TYPED_TEST_SUITE(PointsViewOf, LayoutTypes);

TYPED_TEST(PointsViewOf, ReadsEveryPoint) {
  const auto cloud = makeCloud<TypeParam>();
  const planar_mapping::CloudView view = planar_mapping::viewOf(cloud);
  ASSERT_EQ(view.points().size, 6u);
  EXPECT_FALSE(view.points().isOrganized());
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(view.points().point(static_cast<std::size_t>(i)),
              planar_mapping::Vector3(i, 10 + i, -i));
  }
}

TYPED_TEST(PointsViewOf, StaysValidWhenMoved) {
  const auto cloud = makeCloud<TypeParam>();
  planar_mapping::CloudView first = planar_mapping::viewOf(cloud);
  const planar_mapping::CloudView second = std::move(first);
  EXPECT_EQ(second.points().point(5), planar_mapping::Vector3(5, 15, -5));
}

TYPED_TEST(PointsViewOf, AnEmptyCloudIsAnEmptyView) {
  const pcl::PointCloud<TypeParam> cloud;
  EXPECT_EQ(planar_mapping::viewOf(cloud).points().size, 0u);
}

TYPED_TEST(PointsViewOf, IsOrganizedIfTheShapeFits) {
  auto cloud = makeCloud<TypeParam>();
  cloud.width = 3;
  cloud.height = 2;
  EXPECT_TRUE(planar_mapping::viewOf(cloud).points().isOrganized());
  cloud.height = 5;  // says more points than there are
  const planar_mapping::CloudView view = planar_mapping::viewOf(cloud);
  EXPECT_FALSE(view.points().isOrganized());
  EXPECT_EQ(view.points().size, 6u);
}

TEST(PointsView, PointsOfPclAreNotCopied) {
  const auto cloud = makeCloud<pcl::PointXYZRGB>();
  const planar_mapping::CloudView view = planar_mapping::viewOf(cloud);
  EXPECT_EQ(static_cast<const void*>(view.points().data),
            static_cast<const void*>(&cloud.points[0].x));
}

}  // namespace
