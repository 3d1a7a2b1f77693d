// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "class_contract.h"
#include "evaluation/metrics/cuboid_geometry.h"
#include "planar_mapping/surface/planar_cuboid_approximation.h"
#include "planar_mapping/surface/planar_mapping.h"

namespace planar_mapping::test {
namespace {

/// However few points they hold: the only points dropped are those that are not finite.
PlanarMapParams paramsWithAllCells() {
  PlanarMapParams params;
  params.min_cell_fraction = 0.0;
  return params;
}

template <typename PointT>
struct CuboidSubject {
  using Point = PointT;
  using Class = PlanarCuboidApproximation<PointT>;
  using Base = pcl::PCLSurfaceBase<PointT>;
  static constexpr bool kThrowsWithoutCloud = true;

  static Outcome run(Class& subject) {
    subject.setParams(paramsWithAllCells());
    std::vector<Cuboid> cuboids(3);
    subject.approximate(cuboids);
    Outcome outcome;
    outcome.numbers = numbersOf(cuboids);
    return outcome;
  }
  /// The class counts them among the dropped ones.
  static std::size_t notFinite(const Class& subject) {
    return subject.getDiagnostics().dropped_points;
  }
};

INSTANTIATE_TYPED_TEST_SUITE_P(PlanarCuboidApproximation, ClassContract,
                               AllPointTypes<CuboidSubject>);

TEST(PlanarCuboidApproximationContract, ThreadsNeverChangeTheResult) {
  const auto cloud = makeScene<pcl::PointXYZ>();
  pcl::PointIndices wall;
  for (int i = 0; i < 2000; ++i) wall.indices.push_back(i);
  pcl::ModelCoefficients plane;
  plane.values = {0, 0, -1, 2};
  std::vector<Outcome> outcomes;
  for (const int threads : {1, 2, 0}) {
    PlanarCuboidApproximation<pcl::PointXYZ> approximation;
    approximation.setNumberOfThreads(threads);
    approximation.setInputCloud(cloud);
    approximation.setPlanes({wall}, {plane});
    std::vector<Cuboid> cuboids;
    approximation.approximate(cuboids);
    outcomes.push_back({{}, numbersOf(cuboids)});
    EXPECT_TRUE(outcomes.back() == outcomes.front()) << threads << " threads";
  }
}

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
    outcome.numbers = numbersOf(subject.map().cuboids());
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
