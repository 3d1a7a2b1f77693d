// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/metrics/map_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>

#include "evaluation/baselines/grid_cell.h"
#include "evaluation/metrics/cuboid_geometry.h"
#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping::evaluation {
namespace {

// The figures of a list of cuboids, without an index at hand.
MappingError mappingError(const std::vector<Cuboid>& cuboids, const SurfaceTruth& truth, double s,
                          std::size_t standard_cells) {
  return mappingError(cuboids, CuboidDistance(cuboids), truth, s, standard_cells);
}
double coverage(const std::vector<Cuboid>& cuboids, const std::vector<Vector3>& points,
                double margin) {
  return evaluation::coverage(CuboidDistance(cuboids), points, margin);
}
HeldBackDistance heldBackDistance(const std::vector<Cuboid>& cuboids,
                                  const std::vector<Vector3>& points, double margin) {
  return evaluation::heldBackDistance(CuboidDistance(cuboids), points, margin);
}
double freeSpaceViolation(const std::vector<Cuboid>& cuboids, const std::vector<MeasuredRay>& rays,
                          double s) {
  CrossedSpace crossed(s, 2.0 * s);
  crossed.add(rays);
  return freeSpaceViolation(CuboidDistance(cuboids), crossed);
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A solid with a flat face through the origin, seen from along its normal: 20 m wide.
struct Wall {
  Matrix3 R;  ///< columns u, v, n; n towards free space
  SurfaceTruth truth;

  explicit Wall(const Matrix3& rotation = Matrix3::Identity())
      : R(rotation), truth(sceneOf(rotation)) {}
  static Scene sceneOf(const Matrix3& rotation) {
    Scene scene;
    SceneObject object;
    object.T_world_object.linear() = rotation;
    object.T_world_object.translation() = rotation * Vector3(0, 0, -5);
    object.size = {20, 20, 10};
    scene.objects.push_back(object);
    return scene;
  }
  /// Cuboid with its axes along u, v, n from \p low to \p high in them.
  Cuboid cuboid(const Vector3& low, const Vector3& high) const {
    Cuboid cuboid = test::cuboidAt(R * (0.5 * (low + high)), high - low);
    cuboid.orientation = Quaternion(R);
    return cuboid;
  }
};

Matrix3 tilted() {
  return (Eigen::AngleAxisd(0.5, Vector3::UnitZ()) * Eigen::AngleAxisd(0.7, Vector3::UnitY()))
      .toRotationMatrix();
}

std::vector<Cuboid> randomCuboids(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Cuboid> cuboids(count);
  for (Cuboid& cuboid : cuboids) {
    cuboid.center = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-0.5, 0.5)};
    cuboid.size = {random.uniform(0.05, 0.8), random.uniform(0.05, 0.5), random.uniform(0.01, 0.2)};
    cuboid.orientation =
        Quaternion(random.normal(), random.normal(), random.normal(), random.normal()).normalized();
  }
  return cuboids;
}

TEST(CombinationEfficiency, ByHand) {
  EXPECT_NEAR(combinationEfficiency(30, 1000), 0.97, 1e-12);
  EXPECT_NEAR(combinationEfficiency(11851, 11851), 0.0, 1e-12);
  EXPECT_NEAR(combinationEfficiency(15, 10), -0.5, 1e-12);
  EXPECT_NEAR(combinationEfficiency(0, 10), 1.0, 1e-12);
  EXPECT_THROW(combinationEfficiency(0, 0), InputError);
}

TEST(MappingErrorTest, CellsOfAStandardGridCountOneEach) {
  // The face is at z = 0. Layers of cells of 0.1 m at z = -1 (behind it), 0 (before it), 1 and 5.
  const Wall wall;
  const std::vector<Cuboid> cells = cuboidsOf(
      std::vector<GridCell>{{0, 0, -1}, {1, 0, -1}, {0, 0, 0}, {0, 0, 1}, {0, 0, 5}}, 0.1);
  const MappingError error = mappingError(cells, wall.truth, 0.1, cells.size());
  EXPECT_NEAR(error.wrong_cells, 2.0, 1e-9);
  EXPECT_NEAR(error.marked_cells, 5.0, 1e-9);
  EXPECT_NEAR(error.percent, 40.0, 1e-9);
}

TEST(MappingErrorTest, NobodyGainsByThinCuboids) {
  const Wall wall(tilted());
  for (const auto& [high, cells] : {std::pair(Vector3(1, 1, 0.501), 100.0),  // thin
                                    {Vector3(1, 1, 0.5), 100.0},             // flat
                                    {Vector3(0.01, 0.01, 0.7), 2.0}}) {      // a post
    const Cuboid cuboid = wall.cuboid({0, 0, 0.5}, high);
    EXPECT_NEAR(mappingError({cuboid}, wall.truth, 0.1, 100).wrong_cells, cells, 1e-9);
  }
}

TEST(MappingErrorTest, AgreesWithEveryPartAskedInTurn) {
  const Wall wall(tilted());
  const double s = 0.1;
  const std::vector<Cuboid> cuboids = randomCuboids(40, 3);
  double wrong = 0.0;
  double marked = 0.0;
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    const Cuboid& c = cuboids[i];
    int n[3];
    double weight = 1.0;
    for (int k = 0; k < 3; ++k) {
      n[k] = static_cast<int>(std::ceil(c.size[k] / (s / 4.0)));
      weight *= std::max(c.size[k], s) / s / n[k];
    }
    for (int x = 0; x < n[0]; ++x)
      for (int y = 0; y < n[1]; ++y)
        for (int z = 0; z < n[2]; ++z) {
          const Vector3 local((x + 0.5) / n[0] - 0.5, (y + 0.5) / n[1] - 0.5,
                              (z + 0.5) / n[2] - 0.5);
          const Vector3 p = c.center + c.orientation * local.cwiseProduct(c.size);
          bool before = false;
          for (std::size_t j = 0; j < i; ++j) before = before || contains(cuboids[j], p);
          if (before) continue;
          marked += weight;
          // 20 x 20 x 10 m: nothing is near another face of the solid.
          if (std::abs((wall.R.transpose() * p).z()) > s) wrong += weight;
        }
  }
  ASSERT_GT(wrong, 10.0);
  const MappingError error = mappingError(cuboids, wall.truth, s, 1000);
  EXPECT_NEAR(error.wrong_cells, wrong, 1e-6);
  EXPECT_NEAR(error.marked_cells, marked, 1e-6);
}

TEST(MappingErrorTest, NothingMarkedIsNoErrorAndNothingIsRefused) {
  const Wall wall;
  EXPECT_EQ(mappingError({}, wall.truth, 0.1, 10).percent, 0.0);
  EXPECT_THROW(mappingError({}, wall.truth, 0.1, 0), InputError);
  EXPECT_THROW(mappingError({}, wall.truth, 0.0, 10), ParameterError);
  EXPECT_THROW(mappingError({}, wall.truth, test::kNan, 10), ParameterError);
  EXPECT_THROW(mappingError({}, CuboidDistance({Cuboid()}), wall.truth, 0.1, 10), InputError);
  Cuboid bad;
  bad.size.x() = test::kNan;
  EXPECT_THROW(mappingError({bad}, wall.truth, 0.1, 10), InputError);
}

VisibleCell visibleAt(const Vector3& point) {
  VisibleCell cell;
  cell.point = point;
  cell.pixels = 1;
  return cell;
}

TEST(Completeness, ByHand) {
  // A tilted slab: distances of the points to it are 0, .05, .15 and 1.
  const Wall wall(tilted());
  const CuboidDistance slab({wall.cuboid({0, 0, -0.1}, {1, 1, 0})});
  const std::vector<VisibleCell> visible = {
      visibleAt(wall.R * Vector3(0.5, 0.5, 0.0)), visibleAt(wall.R * Vector3(0.5, 0.5, 0.05)),
      visibleAt(wall.R * Vector3(0.5, 0.5, 0.15)), visibleAt(wall.R * Vector3(2.0, 0.5, 0.0))};
  EXPECT_NEAR(completeness(slab, visible, 0.1), 0.5, 1e-12);
  EXPECT_NEAR(completeness(slab, visible, 0.2), 0.75, 1e-12);
  EXPECT_EQ(completeness(CuboidDistance({}), visible, 0.1), 0.0);
  EXPECT_EQ(evaluation::completeness(slab, {}, 0.1), 1.0);
  EXPECT_THROW(completeness(slab, visible, 0.0), ParameterError);
}

TEST(CoverageMetric, ByHand) {
  const Wall wall(tilted());
  const std::vector<Cuboid> slab = {wall.cuboid({0, 0, -0.1}, {1, 1, 0})};
  const std::vector<Vector3> points = {
      wall.R * Vector3(0.5, 0.5, -0.05), wall.R * Vector3(0.5, 0.5, 0.049),
      wall.R * Vector3(0.5, 0.5, 0.051), wall.R * Vector3(1.03, 1.03, 0.0),
      wall.R * Vector3(1.04, 1.04, 0.0)};  // the last two are .042 and .057 off the edge
  EXPECT_NEAR(coverage(slab, points, 0.05), 0.6, 1e-12);
  EXPECT_NEAR(coverage(slab, points, 0.06), 1.0, 1e-12);
  EXPECT_NEAR(coverage(slab, points, 0.0), 0.2, 1e-12);
}

TEST(CoverageMetric, PointsThatAreNotFiniteDoNotCount) {
  const std::vector<Cuboid> none;
  Cuboid cuboid;
  cuboid.size = Vector3::Ones();
  EXPECT_EQ(coverage({cuboid}, {{0, 0, 0}, {test::kNan, 0, 0}, {0, kInfinity, 0}}, 0.1), 1.0);
  EXPECT_EQ(coverage(none, {{0, 0, 0}}, 0.1), 0.0);
  EXPECT_EQ(coverage({cuboid}, {}, 0.1), 1.0);
  EXPECT_THROW(coverage({cuboid}, {{0, 0, 0}}, -0.1), ParameterError);
  EXPECT_THROW(coverage({cuboid}, {{0, 0, 0}}, test::kNan), ParameterError);
}

TEST(HeldBack, ByHand) {
  // Distances 0, .1, .2, ... 1.9 from a unit cube's face.
  Cuboid cube;
  cube.size = Vector3::Ones();
  std::vector<Vector3> points;
  for (int i = 19; i >= 0; --i) points.emplace_back(0.5 + 0.1 * i, 0.2, 0.3);
  points.emplace_back(test::kNan, 0, 0);
  const HeldBackDistance result = heldBackDistance({cube}, points, 0.55);
  EXPECT_NEAR(result.median, 0.9, 1e-12);                 // the tenth of twenty
  EXPECT_NEAR(result.percentile_95, 1.8, 1e-12);          // the nineteenth
  EXPECT_NEAR(result.fraction_within, 0.3, 1e-12);        // 0 to .5
  EXPECT_NEAR(result.fraction_within_half, 0.15, 1e-12);  // 0 to .2
  EXPECT_NEAR(result.fraction_inside, 0.05, 1e-12);
  const HeldBackDistance empty = evaluation::heldBackDistance(CuboidDistance({}), {{0, 0, 0}}, 0.1);
  EXPECT_EQ(empty.median, kInfinity);
  EXPECT_EQ(empty.fraction_within, 0.0);
  EXPECT_EQ(evaluation::heldBackDistance(CuboidDistance({}), {}, 0.1).fraction_within, 1.0);
}

TEST(HeldBack, AgreesWithEveryCuboidAskedInTurn) {
  Random random(6);
  const std::vector<Cuboid> cuboids = randomCuboids(50, 9);
  std::vector<Vector3> points;
  std::vector<double> distances;
  for (int i = 0; i < 999; ++i) {
    points.emplace_back(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-1, 1));
    double nearest = kInfinity;
    for (const Cuboid& cuboid : cuboids)
      nearest = std::min(nearest, test::distanceTo(cuboid, points.back()));
    distances.push_back(nearest);
  }
  std::sort(distances.begin(), distances.end());
  const HeldBackDistance result = heldBackDistance(cuboids, points, 0.1);
  EXPECT_NEAR(result.median, distances[499], 1e-12);
  EXPECT_NEAR(result.percentile_95, distances[949], 1e-12);
  const auto within =
      std::count_if(distances.begin(), distances.end(), [](double d) { return d <= 0.1; });
  EXPECT_NEAR(result.fraction_within, static_cast<double>(within) / 999.0, 1e-12);
  EXPECT_NEAR(coverage(cuboids, points, 0.1), static_cast<double>(within) / 999.0, 1e-12);
}

TEST(FreeSpace, ByHand) {
  // One ray along x from 0 to 1.2 m, s = 0.1: samples up to 1 m, ten cells; the cuboid is two long.
  Cuboid cuboid = test::cuboidAt({0.5, 0.05, 0.05}, {0.2, 0.1, 0.1});
  for (const std::size_t count : {1, 50}) {  // a cell counts once
    const std::vector<MeasuredRay> rays(count, {{0.0, 0.05, 0.05}, {1.2001, 0.05, 0.05}});
    EXPECT_NEAR(freeSpaceViolation({cuboid}, rays, 0.1), 0.2, 1e-12);
  }
}

TEST(FreeSpace, SurfaceAtTheEndOfTheRayIsNoViolation) {
  // A tilted wall, measured 0.15 m too far and mapped where it is.
  const Wall wall(tilted());
  std::vector<MeasuredRay> rays;
  for (int i = 0; i < 20; ++i)
    rays.push_back({wall.R * Vector3(0.05 * i, 0.5, 3.0), wall.R * Vector3(0.05 * i, 0.5, -0.15)});
  EXPECT_EQ(freeSpaceViolation({wall.cuboid({-1, -1, -0.1}, {2, 2, 0})}, rays, 0.1), 0.0);
  // The same wall a metre nearer is crossed by every ray: about 0.1 of 2.95 m.
  const Cuboid ghost = wall.cuboid({-1, -1, 0.9}, {2, 2, 1.0});
  EXPECT_NEAR(freeSpaceViolation({ghost}, rays, 0.1), 0.1 / 2.95, 0.01);
}

TEST(FreeSpace, AgreesWithEveryCrossedCellAskedInTurn) {
  Random random(12);
  const double s = 0.1;
  const std::vector<Cuboid> cuboids = randomCuboids(30, 14);
  std::vector<MeasuredRay> rays;
  for (int i = 0; i < 300; ++i)
    rays.push_back(
        {{0, 0, 0}, {random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-1, 1)}});
  std::set<std::tuple<int, int, int>> crossed;
  std::size_t marked = 0;
  for (const MeasuredRay& ray : rays) {
    const double length = ray.end.norm();
    for (int i = 0; (i + 0.5) * s / 2 <= length - 2 * s; ++i) {
      const Vector3 p = ray.end / length * ((i + 0.5) * s / 2);
      const auto at = [s](double v) { return static_cast<int>(std::floor(v / s)); };
      if (!crossed.emplace(at(p.x()), at(p.y()), at(p.z())).second) continue;
      marked += std::any_of(cuboids.begin(), cuboids.end(),
                            [&p](const Cuboid& cuboid) { return contains(cuboid, p); });
    }
  }
  ASSERT_GT(marked, 20u);
  EXPECT_NEAR(freeSpaceViolation(cuboids, rays, s),
              static_cast<double>(marked) / static_cast<double>(crossed.size()), 1e-12);
}

TEST(FreeSpace, RaysThatAreNoneAreLeftOut) {
  Cuboid cuboid;
  cuboid.size = Vector3::Constant(10.0);
  const std::vector<MeasuredRay> rays = {{{test::kNan, 0, 0}, {1, 0, 0}},
                                         {{0, 0, 0}, {kInfinity, 0, 0}},
                                         {{0, 0, 0}, {0, 0, 0}},
                                         {{0, 0, 0}, {1e9, 0, 0}},
                                         {{0, 0, 0}, {0.1, 0, 0}}};
  EXPECT_EQ(freeSpaceViolation({cuboid}, rays, 0.1), 0.0);
  EXPECT_THROW(CrossedSpace(0.0, 0.1), ParameterError);
  EXPECT_THROW(CrossedSpace(0.1, -0.1), ParameterError);
  EXPECT_THROW(CrossedSpace(0.1, 0.1, 0), ParameterError);
}

}  // namespace
}  // namespace planar_mapping::evaluation
