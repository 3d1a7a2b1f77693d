// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pcl/points_view.h"

#include <gtest/gtest.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace {

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
using PointTypes = testing::Types<pcl::PointXYZ, pcl::PointXYZI, pcl::PointXYZRGBNormal,
                                  PointDouble, PointBackwards, PointTagged>;
TYPED_TEST_SUITE(PointsViewOf, PointTypes);

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
