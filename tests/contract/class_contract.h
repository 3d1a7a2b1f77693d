// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <pcl/PointIndices.h>
#include <pcl/memory.h>
#include <pcl/pcl_base.h>

#include <cstring>
#include <type_traits>

#include "contract_scene.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping::test {

/// What a run gave, comparable bit by bit.
struct Outcome {
  std::vector<int> indices;     ///< into the input cloud
  std::vector<double> numbers;  ///< everything else
  bool operator==(const Outcome& o) const {
    return indices == o.indices && numbers.size() == o.numbers.size() &&
           (numbers.empty() ||
            std::memcmp(numbers.data(), o.numbers.data(), numbers.size() * sizeof(double)) == 0);
  }
};

/// The PCL class contract as far as it is the same for every class. A Subject names the class and
/// the point type and knows how to run it:
///   using Point, Class, Base;  static Outcome run(Class&);  static std::size_t notFinite(const
///   Class&); static constexpr bool kThrowsWithoutCloud;
template <typename Subject>
class ClassContract : public testing::Test {
 public:
  using SubjectCloud = pcl::PointCloud<typename Subject::Point>;

  static std::vector<int> someIndices(const SubjectCloud& cloud) {
    std::vector<int> indices;
    for (int i = 0; i < static_cast<int>(cloud.size()); ++i) {
      if (i % 3 != 1) indices.push_back(i);
    }
    return indices;
  }
};
TYPED_TEST_SUITE_P(ClassContract);

TYPED_TEST_P(ClassContract, HasTheAliasesOfPcl) {
  using Class = typename TypeParam::Class;
  using Point = typename TypeParam::Point;
  static_assert(std::is_base_of_v<typename TypeParam::Base, Class>);
  static_assert(std::is_same_v<typename Class::Ptr, pcl::shared_ptr<Class>>);
  static_assert(std::is_same_v<typename Class::ConstPtr, pcl::shared_ptr<const Class>>);
  static_assert(std::is_same_v<typename Class::PointCloud, pcl::PointCloud<Point>>);
  static_assert(
      std::is_same_v<typename Class::PointCloudPtr, typename pcl::PointCloud<Point>::Ptr>);
  static_assert(std::is_same_v<typename Class::PointCloudConstPtr,
                               typename pcl::PointCloud<Point>::ConstPtr>);
  static_assert(std::is_copy_constructible_v<Class> && std::is_copy_assignable_v<Class>);
  const typename Class::Ptr pointer(new Class);
  EXPECT_TRUE(pointer != nullptr);
}

TYPED_TEST_P(ClassContract, EveryWayToSetIndicesGivesTheSame) {
  const auto cloud = makeScene<typename TypeParam::Point>();
  pcl::IndicesPtr block(new pcl::Indices);
  for (int row = 10; row < 60; ++row) {
    for (int column = 5; column < 75; ++column) block->push_back(80 * row + column);
  }
  std::vector<Outcome> outcomes;
  for (int way = 0; way < 4; ++way) {
    typename TypeParam::Class subject;
    subject.setInputCloud(cloud);
    if (way == 0) subject.setIndices(block);
    if (way == 1) subject.setIndices(pcl::IndicesConstPtr(new pcl::Indices(*block)));
    if (way == 2) {
      pcl::PointIndices::Ptr indices(new pcl::PointIndices);
      indices->indices = *block;
      subject.setIndices(pcl::PointIndices::ConstPtr(indices));
    }
    if (way == 3) subject.setIndices(10, 5, 50, 70);
    outcomes.push_back(TypeParam::run(subject));
    EXPECT_TRUE(outcomes.back() == outcomes.front()) << "way " << way;
  }
  EXPECT_FALSE(outcomes[0].indices.empty() && outcomes[0].numbers.empty());
}

TYPED_TEST_P(ClassContract, SubsetByIndexEqualsSubsetByCopy) {
  const auto cloud = makeScene<typename TypeParam::Point>();
  const std::vector<int> indices = TestFixture::someIndices(*cloud);
  typename TestFixture::SubjectCloud::Ptr copy(new typename TestFixture::SubjectCloud);
  for (const int i : indices) copy->push_back((*cloud)[i]);
  // The same points in the same order, without the grid: what counts is only what is indexed.
  typename TestFixture::SubjectCloud::Ptr flat(new typename TestFixture::SubjectCloud(*cloud));
  flat->width = static_cast<std::uint32_t>(flat->size());
  flat->height = 1;

  typename TypeParam::Class by_index;
  by_index.setInputCloud(flat);
  by_index.setIndices(pcl::IndicesPtr(new pcl::Indices(indices)));
  typename TypeParam::Class by_copy;
  by_copy.setInputCloud(copy);
  const Outcome a = TypeParam::run(by_index);
  Outcome b = TypeParam::run(by_copy);
  for (int& i : b.indices) i = indices[i];
  EXPECT_EQ(a.indices, b.indices);
  EXPECT_TRUE(a == b);
}

TYPED_TEST_P(ClassContract, ResultsAreIndicesOfTheInputCloud) {
  const auto cloud = makeScene<typename TypeParam::Point>();
  const std::vector<int> indices = TestFixture::someIndices(*cloud);
  typename TypeParam::Class subject;
  subject.setInputCloud(cloud);
  subject.setIndices(pcl::IndicesPtr(new pcl::Indices(indices)));
  for (const int i : TypeParam::run(subject).indices) {
    ASSERT_GE(i, 0);
    ASSERT_LT(i, static_cast<int>(cloud->size()));
    ASSERT_NE(i % 3, 1);
  }
}

TYPED_TEST_P(ClassContract, LeavesTheInputUntouched) {
  const auto cloud = makeScene<typename TypeParam::Point>();
  spoil(*cloud);
  const typename TestFixture::SubjectCloud before = *cloud;
  pcl::IndicesPtr indices(new pcl::Indices(TestFixture::someIndices(*cloud)));
  const pcl::Indices indices_before = *indices;
  typename TypeParam::Class subject;
  subject.setInputCloud(cloud);
  subject.setIndices(indices);
  TypeParam::run(subject);
  const auto a = coordinatesOf(before);
  const auto b = coordinatesOf(*cloud);
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0);
  EXPECT_EQ(*indices, indices_before);
  EXPECT_EQ(cloud->header.stamp, before.header.stamp);
  EXPECT_EQ(cloud->width, before.width);
}

TYPED_TEST_P(ClassContract, RunsAreRepeatable) {
  const auto cloud = makeScene<typename TypeParam::Point>();
  typename TypeParam::Class subject;
  subject.setInputCloud(cloud);
  const Outcome first = TypeParam::run(subject);
  EXPECT_TRUE(TypeParam::run(subject) == first);
  typename TypeParam::Class another;
  another.setInputCloud(cloud);
  EXPECT_TRUE(TypeParam::run(another) == first);
}

TYPED_TEST_P(ClassContract, FollowsAnotherCloud) {
  typename TypeParam::Class subject;
  subject.setInputCloud(makeScene<typename TypeParam::Point>());
  TypeParam::run(subject);
  const auto smaller = makeScene<typename TypeParam::Point>(60, 50);
  subject.setInputCloud(smaller);
  typename TypeParam::Class fresh;
  fresh.setInputCloud(smaller);
  EXPECT_TRUE(TypeParam::run(subject) == TypeParam::run(fresh));
}

TYPED_TEST_P(ClassContract, CopiesAreIndependent) {
  const auto cloud = makeScene<typename TypeParam::Point>();
  typename TypeParam::Class original;
  original.setInputCloud(cloud);
  const Outcome before = TypeParam::run(original);
  typename TypeParam::Class copy = original;
  EXPECT_TRUE(TypeParam::run(copy) == before);
  copy.setInputCloud(makeScene<typename TypeParam::Point>(60, 50));
  TypeParam::run(copy);
  EXPECT_TRUE(TypeParam::run(original) == before);
}

TYPED_TEST_P(ClassContract, NonFinitePointsAreSkippedAndCounted) {
  const auto cloud = makeScene<typename TypeParam::Point>();
  const std::vector<int> spoilt = spoil(*cloud);
  typename TypeParam::Class subject;
  subject.setInputCloud(cloud);
  const Outcome outcome = TypeParam::run(subject);
  for (const int i : outcome.indices) ASSERT_NE(i % 5, 0) << i;
  for (const double number : outcome.numbers) ASSERT_TRUE(std::isfinite(number));
  EXPECT_EQ(TypeParam::notFinite(subject), spoilt.size());
}

TYPED_TEST_P(ClassContract, AcceptsCloudsWithNothingInThem) {
  using Cloud = typename TestFixture::SubjectCloud;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const int kind : {0, 1, 2, 3}) {
    typename Cloud::Ptr cloud(new Cloud);
    for (int i = 0; i < (kind == 0 ? 0 : kind == 1 ? 1 : 300); ++i) {
      typename TypeParam::Point p;
      p.x = kind == 2 ? nan : 1.0f;
      p.y = kind == 2 ? nan : 2.0f;
      p.z = kind == 2 ? nan : 3.0f;
      cloud->push_back(p);
    }
    typename TypeParam::Class subject;
    subject.setInputCloud(cloud);
    const Outcome outcome = TypeParam::run(subject);
    EXPECT_TRUE(kind > 0 || (outcome.indices.empty() && outcome.numbers.empty()));
  }
}

TYPED_TEST_P(ClassContract, NoIndicesMeansNoPoints) {
  typename TypeParam::Class subject;
  subject.setInputCloud(makeScene<typename TypeParam::Point>());
  subject.setIndices(pcl::IndicesPtr(new pcl::Indices));
  EXPECT_TRUE(TypeParam::run(subject).indices.empty());
}

TYPED_TEST_P(ClassContract, IndexOutsideTheCloudIsAnInputError) {
  for (const int bad : {-1, 4800, 2147483647}) {
    typename TypeParam::Class subject;
    subject.setInputCloud(makeScene<typename TypeParam::Point>());
    subject.setIndices(pcl::IndicesPtr(new pcl::Indices{0, bad}));
    EXPECT_THROW(TypeParam::run(subject), InputError) << bad;
  }
}

TYPED_TEST_P(ClassContract, MissingCloudIsAnInputError) {
  typename TypeParam::Class subject;
  if (TypeParam::kThrowsWithoutCloud) {
    EXPECT_THROW(TypeParam::run(subject), InputError);
  }
}

TYPED_TEST_P(ClassContract, SaysNothing) {
  const auto cloud = makeScene<typename TypeParam::Point>();
  spoil(*cloud);
  typename TypeParam::Class subject;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  subject.setInputCloud(cloud);
  TypeParam::run(subject);
  subject.setInputCloud(
      typename TestFixture::SubjectCloud::Ptr(new typename TestFixture::SubjectCloud));
  TypeParam::run(subject);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

REGISTER_TYPED_TEST_SUITE_P(ClassContract, HasTheAliasesOfPcl, EveryWayToSetIndicesGivesTheSame,
                            SubsetByIndexEqualsSubsetByCopy, ResultsAreIndicesOfTheInputCloud,
                            LeavesTheInputUntouched, RunsAreRepeatable, FollowsAnotherCloud,
                            CopiesAreIndependent, NonFinitePointsAreSkippedAndCounted,
                            AcceptsCloudsWithNothingInThem, NoIndicesMeansNoPoints,
                            IndexOutsideTheCloudIsAnInputError, MissingCloudIsAnInputError,
                            SaysNothing);

template <template <typename> class Subject>
using AllPointTypes =
    testing::Types<Subject<pcl::PointXYZ>, Subject<pcl::PointXYZRGB>, Subject<pcl::PointXYZINormal>,
                   Subject<OddPoint>, Subject<FourthUnsetPoint>>;

}  // namespace planar_mapping::test
