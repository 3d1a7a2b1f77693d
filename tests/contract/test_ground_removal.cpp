// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "class_contract.h"
#include "planar_mapping/filters/ground_removal.h"
#include "planar_mapping/filters/kl_occupancy_filter.h"

namespace planar_mapping::test {
namespace {

template <typename PointT>
struct GroundSubject {
  using Point = PointT;
  using Class = GroundRemoval<PointT>;
  using Base = pcl::FilterIndices<PointT>;
  static constexpr bool kThrowsWithoutCloud = false;  // filter() is PCL's own non-virtual code

  static Outcome run(Class& subject) {
    subject.reset();  // where the ground was
    Outcome outcome;
    subject.filter(outcome.indices);
    const Vector4 plane = subject.getGround().plane.coefficients();
    if (subject.getGround().found) outcome.numbers.assign(plane.data(), plane.data() + 4);
    return outcome;
  }
  static std::size_t notFinite(const Class& subject) {
    return subject.getDiagnostics().points_not_measured;
  }
};

INSTANTIATE_TYPED_TEST_SUITE_P(GroundRemoval, ClassContract, AllPointTypes<GroundSubject>);

template <typename PointT>
struct OccupancySubject {
  using Point = PointT;
  using Class = KLOccupancyFilter<PointT>;
  using Base = pcl::FilterIndices<PointT>;
  static constexpr bool kThrowsWithoutCloud = false;  // filter() is PCL's own non-virtual code

  static Outcome run(Class& subject) {
    subject.reset();  // the beliefs
    Outcome outcome;
    subject.filter(outcome.indices);
    for (const int i : outcome.indices) outcome.numbers.push_back(subject.getProbabilities()[i]);
    return outcome;
  }
  static std::size_t notFinite(const Class& subject) {
    return subject.getDiagnostics().points_not_measured;
  }
};

INSTANTIATE_TYPED_TEST_SUITE_P(KLOccupancyFilter, ClassContract, AllPointTypes<OccupancySubject>);

}  // namespace
}  // namespace planar_mapping::test
