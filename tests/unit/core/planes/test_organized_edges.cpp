// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Edges between planes in white noise that is larger than how flat surfaces are.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>

#include "depth_scene.h"
#include "numbers.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping {
namespace {

using namespace test;

constexpr double kNoise = 0.003;  // times z squared

PlaneSet search(const DepthScene& scene) {
  MultiPlaneParams params;
  params.method = PlaneSearchMethod::Organized;
  params.min_inliers = 500;
  return findPlanes(scene.view(), nullptr, params);
}

/// The segment that holds most of a surface, which are what fractions of the two?
struct Match {
  std::size_t segment = 0;
  double recall = 0.0;
  double purity = 0.0;
};

Match match(const DepthScene& scene, const PlaneSet& set, int surface) {
  Match best;
  for (std::size_t k = 0; k < set.planes.size(); ++k) {
    double hits = 0.0;
    for (const int i : set.planes[k].inliers)
      hits += scene.truth[static_cast<std::size_t>(i)] == surface ? 1.0 : 0.0;
    const double recall = hits / static_cast<double>(scene.pixelsOf(surface));
    if (recall <= best.recall) continue;
    best = {k, recall, hits / static_cast<double>(set.planes[k].inliers.size())};
  }
  return best;
}

void expectFound(const DepthScene& scene, const PlaneSet& set, int surface, double fraction,
                 double max_angle) {
  ASSERT_FALSE(set.planes.empty());
  const Match found = match(scene, set, surface);
  EXPECT_GT(found.recall, fraction) << surface;
  EXPECT_GT(found.purity, fraction) << surface;
  EXPECT_LT(angleBetween(set.planes[found.segment].plane, scene.plane(surface)), max_angle)
      << surface;
}

TEST(OrganizedEdges, WhiteNoiseDoesNotTurnPlanes) {
  // A folding screen, 0.25 m a leaf, in noise of 19 mm: a tenth of a leaf is nearer to the next
  // one's plane than its noise.
  constexpr int kLeaves = 6;
  DepthScene scene(320, 240, 400.0);
  for (int i = 0; i < kLeaves; ++i) {
    const double side = i % 2 == 0 ? 1.0 : -1.0;
    scene.addRectangle({0.25 * (i - 2.5), 0.0, 2.5}, {0.125, 0.0, 0.08 * side}, {0.0, 0.8, 0.0});
  }
  scene.render(kNoise, 0.0, 5);
  const PlaneSet set = search(scene);
  EXPECT_EQ(set.planes.size(), static_cast<std::size_t>(kLeaves));
  for (int leaf = 0; leaf < kLeaves; ++leaf)
    expectFound(scene, set, leaf, 0.95, 0.3 * test::kDegree);
}

TEST(OrganizedEdges, WallsAreNotCutByChance) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6, 7, 8}) {
    DepthScene scene(320, 240, 400.0);
    scene.addPlane({0.0, 0.0, 2.5}, {0.4, 0.1, -1.0});
    scene.render(kNoise, 0.05, seed);
    EXPECT_EQ(search(scene).planes.size(), 1U) << seed;
  }
}

TEST(OrganizedEdges, NarrowPlaneBetweenTwoOthersKeepsItsEdges) {
  // Riser, tread and riser of a step seen from above: the tread is 12 pixels high.
  DepthScene scene(320, 240, 400.0);
  scene.addRectangle({0.0, -0.25, 2.5}, {2.0, 0.0, 0.0}, {0.0, 0.7, 0.0});
  scene.addRectangle({0.0, 0.45, 2.325}, {2.0, 0.0, 0.0}, {0.0, 0.0, 0.175});
  scene.addRectangle({0.0, 1.15, 2.15}, {2.0, 0.0, 0.0}, {0.0, 0.7, 0.0});
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    scene.render(kNoise, 0.0, seed);
    const PlaneSet set = search(scene);
    EXPECT_EQ(set.planes.size(), 3U) << seed;
    for (const int riser : {0, 2}) expectFound(scene, set, riser, 0.95, 0.5 * test::kDegree);
    expectFound(scene, set, 1, 0.9, 0.3 * test::kDegree);
  }
}

}  // namespace
}  // namespace planar_mapping
