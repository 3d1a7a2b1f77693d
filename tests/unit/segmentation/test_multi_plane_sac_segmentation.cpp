// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"

#include <gtest/gtest.h>
#include <pcl/point_types.h>

#include <cmath>
#include <limits>
#include <vector>

#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/core/base/error.h"

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

TYPED_TEST(MultiPlaneSegmentation, OnlyIndexedPointsCount) {
  const auto cloud = makeCorner<TypeParam>();
  pcl::IndicesPtr wall(new pcl::Indices);
  for (int i = 3600; i < 6100; ++i) wall->push_back(i);
  this->segmentation_.setInputCloud(cloud);
  this->segmentation_.setIndices(wall);
  this->segment();
  ASSERT_EQ(this->inliers_.size(), 1u);
  EXPECT_EQ(this->inliers_[0].indices, *wall);
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

TYPED_TEST(MultiPlaneSegmentation, AnEmptyCloudHasNoPlanes) {
  this->segmentation_.setInputCloud(
      typename pcl::PointCloud<TypeParam>::Ptr(new pcl::PointCloud<TypeParam>));
  this->segment();
  EXPECT_TRUE(this->planes_.empty());
}

using Segmentation = MultiPlaneSACSegmentation<pcl::PointXYZ>;

TEST(MultiPlaneSegmentationIndices, OutsideTheCloudThrow) {
  const auto cloud = makeCorner<pcl::PointXYZ>();
  Segmentation segmentation;
  segmentation.setInputCloud(cloud);
  segmentation.setIndices(pcl::IndicesPtr(new pcl::Indices{0, 6100}));
  std::vector<pcl::PointIndices> inliers;
  std::vector<pcl::ModelCoefficients> planes;
  EXPECT_THROW(segmentation.segment(inliers, planes), planar_mapping::InputError);
}

TEST(MultiPlaneSegmentationIndices, AnyWayToSetThemIsTheSame) {
  const auto cloud = makeCorner<pcl::PointXYZ>();
  pcl::PointIndices::Ptr message(new pcl::PointIndices);
  for (int i = 0; i < 3600; ++i) message->indices.push_back(i);
  Segmentation segmentation;
  segmentation.setMinInliers(1000);
  segmentation.setInputCloud(cloud);
  segmentation.setIndices(message);
  std::vector<pcl::PointIndices> inliers;
  std::vector<pcl::ModelCoefficients> planes;
  segmentation.segment(inliers, planes);
  ASSERT_EQ(inliers.size(), 1u);
  EXPECT_EQ(inliers[0].indices, message->indices);
}

TEST(MultiPlaneSegmentationIndices, PointsThatAreNotFiniteAreSkipped) {
  const auto cloud = makeCorner<pcl::PointXYZ>();
  (*cloud)[7].y = std::numeric_limits<float>::quiet_NaN();
  cloud->is_dense = false;
  Segmentation segmentation;
  segmentation.setMinInliers(1000);
  segmentation.setInputCloud(cloud);
  std::vector<pcl::PointIndices> inliers;
  std::vector<pcl::ModelCoefficients> planes;
  segmentation.segment(inliers, planes);
  ASSERT_EQ(inliers.size(), 2u);
  EXPECT_EQ(inliers[0].indices.size(), 3599u);
  EXPECT_EQ(segmentation.getDiagnostics().points_not_measured, 1u);
}

TEST(MultiPlaneSegmentationSetters, EachHasItsGetter) {
  Segmentation s;
  s.setDistanceThreshold(0.02);
  EXPECT_EQ(s.getDistanceThreshold(), 0.02);
  s.setMinInliers(17);
  EXPECT_EQ(s.getMinInliers(), 17);
  s.setMaxPlanes(4);
  EXPECT_EQ(s.getMaxPlanes(), 4);
  s.setMethod(planar_mapping::PlaneSearchMethod::Sequential);
  EXPECT_EQ(s.getMethod(), planar_mapping::PlaneSearchMethod::Sequential);
  EXPECT_FALSE(s.getNoiseModel().has_value());
  s.setNoiseModel(planar_mapping::StereoNoise{0.1, 400.0, 0.25});
  ASSERT_TRUE(s.getNoiseModel().has_value());
  EXPECT_EQ(s.getNoiseModel()->focal_length, 400.0);
  s.setNoiseModel(std::nullopt);
  EXPECT_FALSE(s.getNoiseModel().has_value());
  s.setNoiseFactor(2.0);
  EXPECT_EQ(s.getNoiseFactor(), 2.0);
  s.setPatchGap(0.3);
  EXPECT_EQ(s.getPatchGap(), 0.3);
  s.setNumberOfModels(5);
  EXPECT_EQ(s.getNumberOfModels(), 5);
  s.setMaxIterations(99);
  EXPECT_EQ(s.getMaxIterations(), 99);
  s.setMissProbability(0.05);
  EXPECT_EQ(s.getMissProbability(), 0.05);
  s.setSignificance(4.0);
  EXPECT_EQ(s.getSignificance(), 4.0);
  s.setMaxNormalDeviation(0.4);
  EXPECT_EQ(s.getMaxNormalDeviation(), 0.4);
  s.setSeed(7);
  EXPECT_EQ(s.getSeed(), 7u);
  s.setNumberOfThreads(2);
  EXPECT_EQ(s.getNumberOfThreads(), 2);
  const planar_mapping::MultiPlaneParams params = s.getParams();
  Segmentation other;
  other.setParams(params);
  EXPECT_EQ(other.getPatchGap(), 0.3);
}

TEST(MultiPlaneSegmentationSetters, RefuseAndKeepTheOldValue) {
  Segmentation s;
  EXPECT_THROW(s.setDistanceThreshold(-0.1), planar_mapping::ParameterError);
  EXPECT_THROW(s.setDistanceThreshold(std::nan("")), planar_mapping::ParameterError);
  EXPECT_THROW(s.setMinInliers(2), planar_mapping::ParameterError);
  EXPECT_THROW(s.setNumberOfThreads(-1), planar_mapping::ParameterError);
  EXPECT_THROW(s.setNoiseModel(planar_mapping::StereoNoise{0.0, 400.0, 0.25}),
               planar_mapping::ParameterError);
  EXPECT_EQ(s.getDistanceThreshold(), planar_mapping::MultiPlaneParams().distance_threshold);
  EXPECT_EQ(s.getMinInliers(), planar_mapping::MultiPlaneParams().min_inliers);
  EXPECT_FALSE(s.getNoiseModel().has_value());
}

TEST(MultiPlaneSegmentationCopy, CarriesParametersAndCloud) {
  Segmentation::Ptr first(new Segmentation);
  first->setMinInliers(1000);
  first->setInputCloud(makeCorner<pcl::PointXYZ>());
  Segmentation second = *first;
  first.reset();
  std::vector<pcl::PointIndices> inliers;
  std::vector<pcl::ModelCoefficients> planes;
  second.segment(inliers, planes);
  EXPECT_EQ(planes.size(), 2u);
}

}  // namespace
