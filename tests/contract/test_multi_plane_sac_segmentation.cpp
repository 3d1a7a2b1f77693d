// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "class_contract.h"
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"

namespace planar_mapping::test {
namespace {

template <typename PointT>
struct SegmentationSubject {
  using Point = PointT;
  using Class = MultiPlaneSACSegmentation<PointT>;
  using Base = pcl::PCLBase<PointT>;
  static constexpr bool kThrowsWithoutCloud = true;

  static Outcome run(Class& subject) {
    std::vector<pcl::PointIndices> inliers(3);
    std::vector<pcl::ModelCoefficients> planes(5);
    subject.segment(inliers, planes);
    EXPECT_EQ(inliers.size(), planes.size());
    Outcome outcome;
    for (std::size_t i = 0; i < planes.size(); ++i) {
      EXPECT_EQ(inliers[i].header.frame_id, planes[i].header.frame_id);
      outcome.indices.insert(outcome.indices.end(), inliers[i].indices.begin(),
                             inliers[i].indices.end());
      outcome.numbers.insert(outcome.numbers.end(), planes[i].values.begin(),
                             planes[i].values.end());
    }
    return outcome;
  }
  static std::size_t notFinite(const Class& subject) {
    return subject.getDiagnostics().points_not_measured;
  }
};

INSTANTIATE_TYPED_TEST_SUITE_P(MultiPlaneSACSegmentation, ClassContract,
                               AllPointTypes<SegmentationSubject>);

TEST(MultiPlaneSACSegmentationContract, ThreadsNeverChangeTheResult) {
  const auto cloud = makeScene<pcl::PointXYZ>();
  std::vector<Outcome> outcomes;
  for (const int threads : {1, 2, 3, 0}) {
    for (const auto method : {PlaneSearchMethod::MultiRansac, PlaneSearchMethod::Sequential,
                              PlaneSearchMethod::Organized}) {
      MultiPlaneSACSegmentation<pcl::PointXYZ> segmentation;
      segmentation.setNumberOfThreads(threads);
      segmentation.setMethod(method);
      segmentation.setInputCloud(cloud);
      outcomes.push_back(SegmentationSubject<pcl::PointXYZ>::run(segmentation));
      if (outcomes.size() > 3) {
        EXPECT_TRUE(outcomes.back() == outcomes[outcomes.size() - 4])
            << threads << " threads, method " << static_cast<int>(method);
      }
    }
  }
}

}  // namespace
}  // namespace planar_mapping::test
