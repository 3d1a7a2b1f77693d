// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "class_contract.h"
#include "cuboid_numbers.h"
#include "planar_mapping/surface/planar_mapping.h"

namespace planar_mapping::test {
namespace {

template <typename PointT>
struct MappingSubject {
  using Point = PointT;
  using Class = PlanarMapping<PointT>;
  using Base = pcl::PCLBase<PointT>;
  static constexpr bool kThrowsWithoutCloud = true;

  static Outcome run(Class& subject) {
    subject.setParams(paramsWithAllCells());
    subject.reset();
    subject.integrate();
    Outcome outcome;
    append(subject.map().cuboids(), outcome.numbers);
    return outcome;
  }
  /// The class counts them among the dropped ones.
  static std::size_t notFinite(const Class& subject) {
    return subject.getDiagnostics().dropped_points;
  }
};

INSTANTIATE_TYPED_TEST_SUITE_P(PlanarMapping, ClassContract, AllPointTypes<MappingSubject>);

}  // namespace
}  // namespace planar_mapping::test
