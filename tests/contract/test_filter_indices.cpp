// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// What callers of pcl::FilterIndices rely on, for both of our filters.
#include <gtest/gtest.h>

#include <algorithm>

#include "contract_scene.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/filters/ground_removal.h"
#include "planar_mapping/filters/kl_occupancy_filter.h"

namespace planar_mapping::test {
namespace {

template <typename Class>
class FilterContract : public testing::Test {
 public:
  using Point = typename Class::PointCloud::PointType;

  /// A filter that lets some points through and some not.
  static void configure(GroundRemoval<Point>& filter) { filter.reset(); }
  static void configure(KLOccupancyFilter<Point>& filter) {
    filter.reset();
    filter.setRangeFloor(0.0);  // the paper's own: doubts near cells with depth in them
    filter.setMinProbability(0.3);
  }
};

using Filters = testing::Types<GroundRemoval<pcl::PointXYZ>, GroundRemoval<pcl::PointXYZRGB>,
                               GroundRemoval<OddPoint>, KLOccupancyFilter<pcl::PointXYZ>,
                               KLOccupancyFilter<pcl::PointXYZRGB>, KLOccupancyFilter<OddPoint>>;
TYPED_TEST_SUITE(FilterContract, Filters);

template <typename Class>
std::vector<int> filteredIndices(Class& filter) {
  FilterContract<Class>::configure(filter);
  std::vector<int> indices{1, 2, 3};
  filter.filter(indices);
  return indices;
}

TYPED_TEST(FilterContract, CloudAndIndicesAgree) {
  using Cloud = typename TypeParam::PointCloud;
  const auto cloud = makeScene<typename Cloud::PointType>();
  TypeParam filter;
  filter.setInputCloud(cloud);
  const std::vector<int> indices = filteredIndices(filter);
  ASSERT_FALSE(indices.empty());
  ASSERT_LT(indices.size(), cloud->size());
  Cloud output;
  output.push_back(typename Cloud::PointType());
  TestFixture::configure(filter);
  filter.filter(output);
  ASSERT_EQ(output.size(), indices.size());
  for (std::size_t i = 0; i < indices.size(); ++i) EXPECT_EQ(output[i].x, (*cloud)[indices[i]].x);
  EXPECT_EQ(output.width, indices.size());
  EXPECT_EQ(output.height, 1u);
  EXPECT_TRUE(output.is_dense);
}

TYPED_TEST(FilterContract, HeaderAndSensorPoseAreCarriedOver) {
  using Cloud = typename TypeParam::PointCloud;
  const auto cloud = makeScene<typename Cloud::PointType>();
  cloud->sensor_origin_ = Eigen::Vector4f(0.001f, 0.002f, 0.003f, 1.0f);
  cloud->sensor_orientation_ = Eigen::Quaternionf(0.5f, 0.5f, 0.5f, 0.5f);
  for (const bool keep_organized : {false, true}) {
    TypeParam filter;
    filter.setKeepOrganized(keep_organized);
    filter.setInputCloud(cloud);
    Cloud output;
    filter.filter(output);
    EXPECT_EQ(output.header.frame_id, "camera");
    EXPECT_EQ(output.header.stamp, 1234u);
    EXPECT_EQ(output.sensor_origin_, cloud->sensor_origin_);
    EXPECT_EQ(output.sensor_orientation_.coeffs(), cloud->sensor_orientation_.coeffs());
  }
}

TYPED_TEST(FilterContract, KeptAndRemovedAreAll) {
  using Cloud = typename TypeParam::PointCloud;
  const auto cloud = makeScene<typename Cloud::PointType>();
  spoil(*cloud);
  TypeParam filter(true);
  filter.setInputCloud(cloud);
  for (const bool negative : {false, true}) {
    filter.setNegative(negative);
    std::vector<int> all = filteredIndices(filter);
    all.insert(all.end(), filter.getRemovedIndices()->begin(), filter.getRemovedIndices()->end());
    std::sort(all.begin(), all.end());
    ASSERT_EQ(all.size(), cloud->size());
    for (std::size_t i = 0; i < all.size(); ++i) ASSERT_EQ(all[i], static_cast<int>(i));
  }
}

TYPED_TEST(FilterContract, NegativeReturnsTheOtherFinitePoints) {
  using Cloud = typename TypeParam::PointCloud;
  const auto cloud = makeScene<typename Cloud::PointType>();
  const std::vector<int> spoilt = spoil(*cloud);
  TypeParam filter;
  filter.setInputCloud(cloud);
  std::vector<int> all = filteredIndices(filter);
  filter.setNegative(true);
  const std::vector<int> others = filteredIndices(filter);
  EXPECT_FALSE(others.empty());
  all.insert(all.end(), others.begin(), others.end());
  all.insert(all.end(), spoilt.begin(), spoilt.end());
  std::sort(all.begin(), all.end());
  EXPECT_EQ(std::unique(all.begin(), all.end()), all.end());
  EXPECT_EQ(all.size(), cloud->size());
}

TYPED_TEST(FilterContract, OrganizedCloudsStayOrganized) {
  using Cloud = typename TypeParam::PointCloud;
  const auto cloud = makeScene<typename Cloud::PointType>();
  TypeParam filter;
  filter.setInputCloud(cloud);
  const std::vector<int> kept = filteredIndices(filter);
  filter.setKeepOrganized(true);
  testing::internal::CaptureStderr();
  Cloud output;
  TestFixture::configure(filter);
  filter.filter(output);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  ASSERT_EQ(output.width, 80u);
  ASSERT_EQ(output.height, 60u);
  EXPECT_FALSE(output.is_dense);
  std::vector<bool> is_kept(cloud->size(), false);
  for (const int i : kept) is_kept[i] = true;
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    ASSERT_EQ(std::isfinite(output[i].x), is_kept[i]);
    ASSERT_EQ(std::isfinite(output[i].z), is_kept[i]);
    if (is_kept[i]) {
      ASSERT_EQ(output[i].y, (*cloud)[i].y);
    }
  }
}

TYPED_TEST(FilterContract, UserFilterValueReplacesWhatIsRemoved) {
  using Cloud = typename TypeParam::PointCloud;
  const auto cloud = makeScene<typename Cloud::PointType>();
  TypeParam filter;
  filter.setInputCloud(cloud);
  const std::vector<int> kept = filteredIndices(filter);
  filter.setKeepOrganized(true);
  filter.setUserFilterValue(-7.0f);
  Cloud output;
  TestFixture::configure(filter);
  filter.filter(output);
  const auto replaced = std::count_if(output.begin(), output.end(), [](const auto& p) {
    return p.x == -7.0f && p.y == -7.0f && p.z == -7.0f;
  });
  EXPECT_EQ(static_cast<std::size_t>(replaced), cloud->size() - kept.size());
  EXPECT_TRUE(output.is_dense);
}

TYPED_TEST(FilterContract, InPlaceEqualsElsewhere) {
  using Cloud = typename TypeParam::PointCloud;
  for (const bool keep_organized : {false, true}) {
    const auto cloud = makeScene<typename Cloud::PointType>();
    TypeParam filter;
    filter.setKeepOrganized(keep_organized);
    filter.setInputCloud(cloud);
    Cloud elsewhere;
    TestFixture::configure(filter);
    filter.filter(elsewhere);
    TestFixture::configure(filter);
    filter.filter(*cloud);
    ASSERT_EQ(cloud->size(), elsewhere.size());
    EXPECT_EQ(cloud->width, elsewhere.width);
    EXPECT_EQ(cloud->header.frame_id, "camera");
    for (std::size_t i = 0; i < cloud->size(); ++i)
      ASSERT_TRUE((*cloud)[i].x == elsewhere[i].x || std::isnan(elsewhere[i].x));
  }
}

TYPED_TEST(FilterContract, RunOfACopyLeavesTheResultOfTheOriginal) {
  using Cloud = typename TypeParam::PointCloud;
  TypeParam original(true);
  original.setInputCloud(makeScene<typename Cloud::PointType>());
  filteredIndices(original);
  const std::vector<int> removed = *original.getRemovedIndices();
  TypeParam copy(original);
  TypeParam assigned;
  assigned = original;
  for (TypeParam* other : {&copy, &assigned}) {
    other->setInputCloud(makeScene<typename Cloud::PointType>(20, 10));
    filteredIndices(*other);
    EXPECT_EQ(*original.getRemovedIndices(), removed);
  }
}

TYPED_TEST(FilterContract, MissingCloudKeepsPclsBehaviour) {
  TypeParam filter;
  std::vector<int> indices{1, 2, 3};
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  EXPECT_NO_THROW(filter.filter(indices));
  testing::internal::GetCapturedStdout();
  testing::internal::GetCapturedStderr();
  EXPECT_EQ(indices.size(), 3u);
}

}  // namespace
}  // namespace planar_mapping::test
